#!/usr/bin/env bash
# The packages in an empty Debian: installs them, runs the demo, builds somebody else's project and runs the Python
# example.  debian_test.sh FOLDER_OF_PACKAGES   (as root; needs debootstrap, 3 GB and the mirrors that apt uses here)
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
packages=$(cd "$1" && pwd)

skip() { echo "debian: SKIPPED, $1"; exit 77; }
[ "$(id -u)" -eq 0 ] || skip "as only root can make and enter another system"
command -v debootstrap >/dev/null || skip "as debootstrap is not installed"
mirrors() { apt-get indextargets --format "\$(REPO_URI) \$(RELEASE) \$(COMPONENT)" 'Created-By: Packages' 'Origin: Debian' | sort -u; }
release=$(. /etc/os-release && echo "$VERSION_CODENAME")
mirror=$(mirrors | awk -v release="$release" '$2 == release {print $1; exit}')
[ -n "$mirror" ] || skip "as apt knows no mirror of $release (apt-get update?)"

root=$(mktemp -d -p "${TMPDIR:-/var/tmp}")
clean() { mountpoint -q "$root/proc" && umount "$root/proc"; rm -rf "$root"; }
trap clean EXIT
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
install() { inside apt-get install -y -qq --no-install-recommends "$@" >>"$root/apt.log" 2>&1 || { tail -30 "$root/apt.log" >&2; exit 1; }; }
debs() { find "$root/packages" -name "$1.deb" -printf '/packages/%f\n'; }

echo "debian: an empty $release"
debootstrap --variant=minbase "$release" "$root" "$mirror" >"$root.log" 2>&1 || { tail "$root.log" >&2; rm "$root.log"; exit 1; }
rm "$root.log"
mirrors | sed 's/^/deb /' >"$root/etc/apt/sources.list"
cp /etc/resolv.conf "$root/etc/"
mount -t proc proc "$root/proc"
cp -r "$packages" "$root/packages"
mkdir -p "$root/source/tests"
cp -r "$source/examples" "$root/source/"
cp -r "$source/tests/install" "$root/source/tests/"
inside apt-get update -qq

echo "debian: the program"
install $(debs 'palpate_*')
inside palpate --version
inside palpate demo -o /demo
inside palpate compare /demo/forces.csv /demo/recording/truth.csv

echo "debian: somebody else's project"
install cmake make g++ $(debs 'libpalpate*')
inside cmake -S /source/tests/install -B /build -DCMAKE_BUILD_TYPE=Release >/dev/null
inside cmake --build /build -j "$(nproc)"
inside /build/bin/example_punch /source/tests/install/organ.obj
inside /build/bin/example_forces /demo/recording/scene.yaml >"$root/cpp.txt"

echo "debian: the Python module"
install $(debs 'python3-palpate_*')
inside python3 -c 'import palpate; print("palpate", palpate.__version__)'
inside python3 /source/examples/forces.py /demo/recording/scene.yaml >"$root/python.txt"
diff "$root/cpp.txt" "$root/python.txt"
[ "$(wc -l <"$root/cpp.txt")" -gt 100 ]

echo "debian: removed again"
inside apt-get purge -y -qq palpate libpalpate-dev python3-palpate 'libpalpate0*' >/dev/null
left=$(find "$root/usr" -name '*palpate*' -not -path '*/__pycache__*')
[ -z "$left" ] || { echo "left behind: $left" >&2; exit 1; }
echo "debian: passed"
