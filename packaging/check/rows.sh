# SPDX-License-Identifier: MIT
# Sourced by test.sh, after setup.sh. Writes results as rows to $logs/rows/$lane, from which results.py makes
# the table at the end. results.py describes the format of the rows.

results() { python3 "$project/packaging/check/results.py" "$@"; }

# note NAME PASSED FAILED NOT_RUN: writes a row; zero passed and failed tests count as a failure
note() {
  local p=${2:-0} f=${3:-0} s=${4:-0}
  if [ $((p + f)) -eq 0 ]; then f=1; fi
  printf 'row\t%s\t%d\t%d\t%d\n' "$1" "$p" "$f" "$s" >> "$logs/rows/$lane"
}
say() { printf 'say\t%s\n' "$1" >> "$logs/rows/$lane"; } # say TEXT: a line without numbers, for example NOT RUN
# note_report NAME REPORT EXIT [--files FILE...]: writes the rows of a JUnit report
note_report() { results rows "$@" >> "$logs/rows/$lane" || note "$1" 0 1; }
check() { # check NAME COMMAND...: runs a command and writes one row: passed or failed
  local name=$1
  shift
  if "$@"; then
    note "$name" 1 0
  else
    note "$name" 0 1
    return 1
  fi
}

# run_lane NAME COMMAND...: runs COMMAND as a lane. Its rows go to the lane's file, and the lane's name precedes
# each line of its output. The row `end` is missing if the lane does not finish.
run_lane() {
  lane=$1
  shift
  : > "$logs/rows/$lane"
  stages="$logs/rows/$lane"
  { "$@" && step "" && printf 'end\n' >> "$logs/rows/$lane"; } 2>&1 | sed -u "s/^/$lane: /"
}
