# SPDX-License-Identifier: MIT
# Sourced after setup.sh by scripts whose every step is one row, `row<TAB>name<TAB>passed<TAB>failed`:
# $logs is where the steps' output lies, and failed is 1 once a step did not work.
failed=0

works() { # works NAME LOG COMMAND...: one row
  local name=$1 log="$logs/$2.log" good=1
  shift 2
  "$@" > "$log" 2>&1 || good=0
  [ $good = 1 ] || { tail -n 30 "$log" && failed=1; }
  printf 'row\t%s\t%d\t%d\n' "$name" $good $((1 - good))
  [ $good = 1 ]
}
