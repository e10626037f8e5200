#!/usr/bin/env bash
# Makes the installer for Windows of a folder with files. tools/windows_package.sh calls it.
#   tools/windows_installer.sh VERSION FOLDER SETUP.exe
set -euo pipefail
version=$1 staged=$(realpath "$2") setup=$(realpath "$3")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# What an uninstaller removes: files first, then folders from the inside out.
{
  (cd "$staged" && find . -type f -printf 'Delete "$INSTDIR\\%P"\n')
  (cd "$staged" && find . -mindepth 1 -depth -type d -printf 'RMDir "$INSTDIR\\%P"\n')
} | tr / '\\' >"$work/remove.nsh"
makensis -V2 -DVERSION="$version" -DFOLDER="$staged" -DREMOVE="$work/remove.nsh" -DOUTPUT="$setup" \
  "$(dirname "$0")/../packaging/windows/tagrid.nsi"
