#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# style.sh: runs the static checks: style, format, types, and the rules on imports between folders. test.sh,
# the hooks of .pre-commit-config.yaml and the workflows call this script. It uses the tools of .venv, in the
# versions of requirements.txt.
#
#   style.sh            runs all checks; exit code 1 if one fails
#   style.sh CHECK...   runs these checks only
#   style.sh --list     prints the names of the checks, one per line
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
cd "$project" || exit 1
checks=(ruff-check ruff-format clang-format mypy-package mypy-logic pyright layers)
bin="$venv/bin"
[ -d "$bin" ] || bin="$venv/Scripts" # Windows
python_folders=(native addon tests blender_tests packaging)

check() { # check NAME
  case $1 in
    ruff-check) "$bin/ruff" check -q "${python_folders[@]}" ;;
    ruff-format) "$bin/ruff" format --check -q "${python_folders[@]}" ;;
    clang-format)
      find native tests \( -name '*.h' -o -name '*.cpp' \) -print0 | xargs -0 "$bin/clang-format" --dry-run -Werror
      ;;
    # MYPYPATH makes mypy check the package in the tree instead of the installed wheel.
    mypy-package) MYPYPATH="$project/native/python" "$bin/mypy" --no-error-summary -p risorius -p risorius_people ;;
    mypy-logic)
      "$bin/mypy" --no-error-summary --explicit-package-bases --follow-imports=silent addon/risorius/logic
      ;;
    pyright) "$bin/pyright" ;;
    layers) "$bin/python" -m pytest -q tests/layers ;;
    *) echo "style.sh: $1 is none of ${checks[*]}, --list" >&2 && return 2 ;;
  esac
}

[ "${1:-}" != --list ] || { printf '%s\n' "${checks[@]}" && exit 0; }
[ -d "$bin" ] || { echo "style.sh: there is no .venv: packaging/check/hooks.sh makes it" >&2 && exit 1; }
[ $# -gt 0 ] || set -- "${checks[@]}"
failed=0
for name; do
  if check "$name"; then
    echo "$name: passed"
  else
    failed=1
    echo "$name: failed" >&2
  fi
done
exit $failed
