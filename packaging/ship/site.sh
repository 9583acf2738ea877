#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# site.sh: builds the documentation as a site in build/site/html with mkdocs-material. The pages come from
# docs/ and the READMEs, from the registered classes (panels and operators), from --help (commands), from
# docstrings (Python) and from headers (C++). A warning is an error, and every link of the finished pages
# is checked. Needs the extension's zip in build/dist; --build makes it.
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed.
#
#   site.sh [--build]
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/check/works.sh"
site="$project/build/site"
own="$project/packaging/ship/site"
tools="$project/build/venv-site"
logs="$project/build/logs/site"
mkdir -p "$site" "$logs"
site_tools() {
  local stamp
  stamp="$tools/.$(sha256sum "$own/requirements.txt" | cut -c1-16)"
  [ -e "$stamp" ] && return 0
  python3.11 -m venv "$tools" && "$tools/bin/python" -m pip install -q -r "$own/requirements.txt" &&
    touch "$stamp"
}
case "${1:-}" in
  "") ;;
  --build) install_packages && make_venv && build_wheel && build_extension || exit 1 ;;
  *) echo "site.sh: $1 is not --build" >&2 && exit 2 ;;
esac
zip=$(ls "$project"/build/dist/risorius-*.zip 2> /dev/null | head -n 1)
[ -n "$zip" ] || { echo "site.sh: there is no build/dist/risorius-*.zip: build_extension" >&2 && exit 1; }

step "site"
works "site: tools" tools site_tools &&
  works "site: panels and operators" panels limited 300 "$python" "$own/blender_classes.py" "$zip" "$site/classes.json" &&
  works "site: pages" pages "$python" "$own/gather.py" "$site/pages" "$site/classes.json" &&
  works "site: mkdocs build --strict" mkdocs "$tools/bin/python" -m mkdocs build --strict --quiet -f "$site/mkdocs.yml" &&
  works "site: links" links "$tools/bin/python" "$own/links.py" "$site/html"
step ""
[ $failed -eq 0 ]
