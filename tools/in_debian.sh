#!/usr/bin/env bash
# Runs a command in this folder on another release of Debian:
#   tools/in_debian.sh 13 tools/test.sh
# The release is installed by debootstrap in build/debian-N, once; what is built there stays in build/debian-N-build.
# Needs root. The host's sources of packages are used, with the name of the release in place of the host's.
set -euo pipefail
[ $# -ge 2 ] || { echo "usage: $0 11|12|13 COMMAND [ARGUMENT ...]" >&2; exit 64; }
case "$1" in
  11) name=bullseye ;;  # too old to build on, but not for tools/static.sh's program
  12) name=bookworm ;;
  13) name=trixie ;;
  *) echo "$0: $1: is not 11, 12 or 13" >&2; exit 64 ;;
esac
project=$(realpath "$(dirname "$0")/..")
root=$project/build/debian-$1
shift
[ "$(id -u)" -eq 0 ] || { echo "$0: needs root, for debootstrap and chroot" >&2; exit 74; }

if [ ! -e "$root/complete" ]; then
  command -v debootstrap >/dev/null || { apt-get update -qq; apt-get install -y -qq --no-install-recommends debootstrap >/dev/null; }
  mirror=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
    awk '$1 == "URIs:" || $1 == "deb" { for (i = 2; i <= NF; ++i) if ($i ~ /^https?:/ && $i !~ /security/) { print $i; exit } }') || true
  echo "Installing Debian ($name) in $root, some minutes"
  rm -rf "$root"
  mkdir -p "$root"
  debootstrap --variant=minbase --include=ca-certificates "$name" "$root" "${mirror:-http://deb.debian.org/debian}" >"$root.log" 2>&1 ||
    { tail -5 "$root.log" >&2; echo "$0: debootstrap failed; see $root.log" >&2; exit 74; }
  # How the host reaches its packages.
  cp /etc/apt/apt.conf.d/* "$root/etc/apt/apt.conf.d/" 2>/dev/null || true
  # What is lost with the power is installed again.
  echo force-unsafe-io >"$root/etc/dpkg/dpkg.cfg.d/unsafe-io"
  touch "$root/complete"
fi

mkdir -p "$root/work" "$root-build"
# Mounts end with the process, and the command ends with this script.
# shellcheck disable=SC2016
exec unshare --mount --pid --fork --kill-child --mount-proc="$root/proc" bash -c '
  set -e
  # What unshares its mounts, as some tests do, needs a root that is a mount.
  mount --rbind "$2" "$2"
  mount --bind "$1" "$2/work"
  mount --bind "$2-build" "$2/work/build"
  mount --rbind /dev "$2/dev"
  mount --rbind /sys "$2/sys"
  # The numbers of processes begin anew, and Open MPI names its folders by them.
  mount -t tmpfs tmpfs "$2/tmp"
  root=$2
  shift 2
  exec chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 TERM="${TERM:-dumb}" \
    bash -c '\''cd /work && exec "$@"'\'' bash "$@"' bash "$project" "$root" "$@"
