# SPDX-License-Identifier: MIT
# Sourced by test.sh, after setup.sh: what ran is written as rows of $logs/rows/$lane (results.py says
# how they look), from which the closing table is made.

results() { python3 "$project/packaging/check/results.py" "$@"; }

# note NAME PASSED FAILED NOT_RUN; no test at all is a failure
note() {
  local p=${2:-0} f=${3:-0} s=${4:-0}
  if [ $((p + f)) -eq 0 ]; then f=1; fi
  printf 'row\t%s\t%d\t%d\t%d\n' "$1" "$p" "$f" "$s" >> "$logs/rows/$lane"
}
say() { printf 'say\t%s\n' "$1" >> "$logs/rows/$lane"; } # a line without numbers: what did not run
# note_report NAME REPORT EXIT [--files FILE...]: the tests of a JUnit report
note_report() { results rows "$@" >> "$logs/rows/$lane" || note "$1" 0 1; }
check() { # check NAME COMMAND...: a tool that passes or fails as a whole
  local name=$1
  shift
  if "$@"; then
    note "$name" 1 0
  else
    note "$name" 0 1
    return 1
  fi
}

# run_lane NAME COMMAND...: everything that COMMAND notes belongs to this lane; its name stands before
# what it says. A lane that does not come to its end has no row `end`.
run_lane() {
  lane=$1
  shift
  : > "$logs/rows/$lane"
  stages="$logs/rows/$lane"
  { "$@" && step "" && printf 'end\n' >> "$logs/rows/$lane"; } 2>&1 | sed -u "s/^/$lane: /"
}
