#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From a bare Debian 12: the packages of ./dev package are installed, and a program is built with them
# three ways. Needs root, mmdebstrap and a Debian mirror, so ctest does not run it; prints times and
# bytes. BARE names a tarball of the bare system that is kept between runs.
# A mount of its own, which ends with this program.
[ -n "${ALONE:-}" ] || [ "$(id -u)" != 0 ] || ALONE=yes exec unshare -m "$0" "$@"
. "$(dirname "$0")/common.sh"
command -v mmdebstrap >/dev/null || skip "mmdebstrap is not installed"
[ "$(id -u)" = 0 ] || skip "a chroot needs root"
BARE=${BARE:-$WORK/bare.tar} ROOT=$WORK/root
[ -e "$BARE" ] || mmdebstrap --quiet --variant=minbase bookworm "$BARE"
mkdir "$ROOT" && tar -C "$ROOT" -xf "$BARE" --exclude='./dev/*'
cp /etc/resolv.conf "$ROOT/etc/"
mkdir -p "$ROOT/dev" && mount --bind /dev "$ROOT/dev"
trap 'umount "$ROOT/dev"; rm -rf "$WORK"' EXIT
mkdir -p "$ROOT/packages" "$ROOT/try"
cp "$BUILD"/packages/*.deb "$ROOT/packages/"
cp "$SOURCE/runtime/examples/hello.c" "$SOURCE/tests/install/consumer/CMakeLists.txt" "$ROOT/try/"
inside() { chroot "$ROOT" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive sh -ec "$1"; }
took() { local start=$SECONDS; "${@:2}" >"$WORK/log" 2>&1 || { tail -n 30 "$WORK/log" >&2; fail "$1"; }; echo "$1: $((SECONDS - start)) s"; }
took "the package lists" inside 'apt-get update'
took "the packages" inside 'apt-get install -y --no-install-recommends /packages/*.deb'
grep -E '^(Need to get|After this)' "$WORK/log" || true
took "a compiler" inside 'apt-get install -y --no-install-recommends gcc g++ libc6-dev cmake make pkg-config libtbb-dev'
took "find_package" inside 'cmake -S /try -B /try/build -DHOW=find_package -DPROGRAM=/try/hello.c && cmake --build /try/build'
inside '/try/build/consumer' | says_right "find_package, shared"
inside '/try/build/consumer_static' | says_right "find_package, static"
took "pkg-config" inside 'gcc -std=c99 /try/hello.c $(pkg-config --cflags --libs hapsix) -o /try/hello'
inside /try/hello | says_right "pkg-config"
took "one line" inside 'gcc -std=c99 /try/hello.c -lhapsix -o /try/hello2'
inside /try/hello2 | says_right "gcc -lhapsix"
if inside 'command -v hapsix >/dev/null'; then
  took "a scene" inside 'hapsix run box-on-wall --virtual-time --json'
  inside 'test -e /usr/share/man/man1/hapsix.1 -o -e /usr/share/man/man1/hapsix.1.gz'
fi
if inside 'test -e /usr/lib/python3/dist-packages/hapsix'; then
  cp "$SOURCE/python/examples/hello.py" "$ROOT/try/"
  took "a Python program" inside 'python3 /try/hello.py'
fi
du -sh "$ROOT/packages" | sed 's/\t.*/ of packages/'
