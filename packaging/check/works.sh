# SPDX-License-Identifier: MIT
# Sourced after setup.sh by scripts that print a row `row<TAB>name<TAB>passed<TAB>failed` for each step. $logs
# is the folder of the steps' output. `failed` becomes 1 if a step fails.
failed=0

works() { # works NAME LOG COMMAND...: runs a command with its output in $logs/LOG.log, and prints a row
  local name=$1 log="$logs/$2.log" good=1
  shift 2
  "$@" > "$log" 2>&1 || good=0
  [ $good = 1 ] || { tail -n 30 "$log" && failed=1; }
  printf 'row\t%s\t%d\t%d\n' "$name" $good $((1 - good))
  [ $good = 1 ]
}
