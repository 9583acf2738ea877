#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# web.sh: builds the empty page of `risorius web`, build/web/page.html. zig (PyPI) compiles native/ to
# WebAssembly with SIMD. esbuild bundles native/web and three.js (npm, package-lock.json) into one script.
# assemble.py puts both into one file, which the next wheel contains. --check also tests the page in
# Debian's chromium: see web/check.py.
# Prints rows `row<TAB>name<TAB>passed<TAB>failed`; exit code 0 only if nothing failed.
set -uo pipefail
source "$(dirname "$0")/../setup.sh"
source "$project/packaging/check/works.sh"

out="$project/build/web"
logs="$project/build/logs/web"
venv_zig="$project/build/cross/venv"
most=700000 # largest size of the page in bytes; the wheel compresses it to about a third
case "${1:-}" in
  "" | --check) ;;
  *) echo "web.sh: $1 is not --check" >&2 && exit 2 ;;
esac

get_tools() {
  local stamp
  stamp="$out/npm/.$(sha256sum "$project/native/web/package-lock.json" | cut -c1-16)"
  if [ ! -x "$venv_zig/bin/python" ]; then
    python3 -m venv "$venv_zig" || return 1
  fi
  "$venv_zig/bin/python" -m pip install -q -r "$project/packaging/ship/cross/requirements.txt" || return 1
  [ -e "$stamp" ] && return 0
  mkdir -p "$out/npm" && cp "$project"/native/web/package*.json "$out/npm/" &&
    (cd "$out/npm" && npm ci --silent --no-audit --no-fund) && touch "$stamp"
}
# sources FOLDER: prints the source files that the functions of risorius.h need. Code for files and threads
# is left out, because a browser has neither. The library is compiled without exceptions: it ends if memory
# runs out, and the page reports that. The files of one folder are compiled as one unit.
sources() {
  find "$project/native/$1" -name '*.cpp' -not -name 'json_*.cpp' -not -name write.cpp -not -name rig_file.cpp \
    -not -name 'file_*.cpp' -not -name read_at.cpp -not -name change_of_basis.cpp \
    -not -name coordinates.cpp -not -path '*/mixer/*' -not -name '*encode*.cpp' | LC_ALL=C sort
}
compile_library() {
  local version exports folder files=() name
  version=$(sed -nE 's/^project\(risorius VERSION ([0-9.]+).*/\1/p' "$project/CMakeLists.txt")
  exports=$(sed -nE 's/^RISORIUS_API .*[ *](risorius_[a-z_]+)\(.*/-Wl,--export=\1/p' "$project/native/api/risorius.h" |
    grep -v open_file)
  for folder in api bytes clip compile core dna rig; do
    sources $folder | sed 's/.*/#include "&"/' > "$out/$folder.cpp"
    # size_t has 32 bits in WebAssembly. Narrowing the sizes of a block is safe, because the reader has
    # already compared them as 64 bits with the block's bytes.
    [ $folder != rig ] || sed -i '1i #pragma clang diagnostic ignored "-Wc++11-narrowing"' "$out/rig.cpp"
    files+=("$out/$folder.cpp")
  done
  for name in cpu dispatch kernels_scalar kernels_sse4 kernels_avx2 kernels_avx512 kernels_neon; do
    files+=("$project/native/simd/$name.cpp")
  done
  # The browser's only thread never ends, so its destructors need no registration.
  echo 'extern "C" int __cxa_thread_atexit(void (*f)(void*), void* p, void* d) { (void)f; (void)p; (void)d; return 0; }' \
    > "$out/thread.cpp"
  files+=("$out/thread.cpp" "$project/native/web/page.cpp")
  # shellcheck disable=SC2086
  "$venv_zig/bin/python" -m ziglang c++ -target wasm32-wasi -mexec-model=reactor -std=c++20 -O3 -msimd128 \
    -ffp-contract=off -fno-exceptions -fno-rtti -fno-sanitize=undefined -fvisibility=hidden -DNDEBUG \
    -DRISORIUS_STATIC -DRISORIUS_VERSION="\"$version\"" -I"$project/native" -I"$out/include" "${files[@]}" \
    -s -Wl,--gc-sections -Wl,--export=malloc -Wl,--export=free \
    -Wl,--export=page_pose -Wl,--export=page_clip $exports -Wl,--initial-memory=16777216 \
    -Wl,--max-memory=2147483648 -Wl,-z,stack-size=1048576 -o "$out/risorius.wasm"
}
bundle() {
  NODE_PATH="$out/npm/node_modules" "$out/npm/node_modules/.bin/esbuild" "$project/native/web/main.js" --bundle --minify \
    --format=iife --target=es2022 --legal-comments=inline --outfile="$out/viewer.js"
}
assemble() {
  python3 "$project/packaging/ship/web/assemble.py" "$project/native/web" "$out" && [ "$(stat -c %s "$out/page.html")" -le $most ] &&
    ls -l "$out"/{risorius.wasm,viewer.js,page.html}
}

mkdir -p "$out/include" "$logs"
cp /usr/include/xxhash.h "$out/include/"
step "tools"
works "web page, tools" tools get_tools || exit 1
step "WebAssembly"
works "web page, native/ as WebAssembly" library compile_library || exit 1
step "script"
works "web page, three.js and native/web" bundle bundle && works "web page, one file" page assemble || exit 1
tail -n 3 "$logs/page.log"
if [ "${1:-}" = --check ]; then
  step "chromium"
  works "web page in chromium, numbers and picture" check "$python" "$project/packaging/ship/web/check.py" "$out"
  cat "$logs/check.log"
fi
step ""
[ $failed -eq 0 ]
