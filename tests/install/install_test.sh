#!/usr/bin/env bash
# Installs a build, moves it elsewhere, and builds and runs programs against what stands there:  install_test.sh BUILD
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/first" >"$work/install.log"
mv "$work/first" "$work/moved"
if grep -rl "$build" "$work/moved" --include='*.cmake'; then
  echo "the files above name the folder of the build" >&2
  exit 1
fi

[ "$("$work/moved/bin/palpate" --version)" = "$("$build/bin/palpate" --version)" ]
if command -v man >/dev/null; then
  man -l --warnings "$work/moved/share/man/man1/palpate.1.gz" >"$work/man.txt" 2>"$work/man.log"
  grep -q 'palpate estimate' "$work/man.txt"
  [ ! -s "$work/man.log" ] || { cat "$work/man.log" >&2; exit 1; }
fi

export CMAKE_PREFIX_PATH=$work/moved
cmake -S "$here" -B "$work/build" -DCMAKE_BUILD_TYPE=Release >"$work/configure.log"
cmake --build "$work/build" -j 2 >"$work/build.log" || { cat "$work/build.log" >&2; exit 1; }
ldd "$work/build/bin/example_punch" | grep -q "$work/moved/lib.*libpalpate.so"
"$work/build/bin/example_punch" "$here/organ.obj"
if bash -c '"$0" none.yaml; exit' "$work/build/bin/example_forces" 2>"$work/error"; then exit 1; fi
grep -q 'does not exist' "$work/error"
