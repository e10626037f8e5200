#!/usr/bin/env bash
# Stands in for `ssh HOST COMMAND ...`, on this machine. The command sees its own host name, which it can resolve, its own
# /dev/shm, IPC and TMPDIR, so processes of two such nodes cannot share memory. All else is the same, but for the folder
# TAGRID_MISSING_ON_<HOST>, which is empty there. Needs the rights of root.
set -euo pipefail
export host=$1
shift
# shellcheck disable=SC2016
exec unshare --mount --uts --ipc bash -c '
  set -e
  hostname "$host"
  mount -t tmpfs tmpfs /dev/shm
  export TMPDIR=/dev/shm/scratch_of_$host
  mkdir "$TMPDIR"
  echo "127.0.0.1 localhost $host" > /dev/shm/hosts
  mount --bind /dev/shm/hosts /etc/hosts
  missing=TAGRID_MISSING_ON_$host
  [ -z "${!missing:-}" ] || mount -t tmpfs tmpfs "${!missing}"
  eval "$*"' bash "$@"
