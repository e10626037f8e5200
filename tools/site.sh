#!/usr/bin/env bash
# Builds the site of the documents, with references of Python, C, C++ and JavaScript, into a folder that is new or empty:
#   tools/site.sh FOLDER
# Open FOLDER/index.html: no server is needed. A broken link or anchor is an error.
# tools/install_packages.sh site installs what it needs, except npm's typedoc, typescript and typedoc-plugin-markdown for
# JavaScript, which it takes from $TAGRID_NODE_MODULES. Without these, it leaves out this reference and says so.
set -euo pipefail
[ $# -eq 1 ] || { echo "usage: $0 FOLDER" >&2; exit 64; }
project=$(realpath "$(dirname "$0")/..")
folder=$(realpath -m "$1")
[ ! -e "$folder" ] || [ -z "$(ls -A "$folder")" ] || { echo "$0: $folder is not empty" >&2; exit 73; }
python=/usr/bin/python3  # Debian's, which has Debian's Sphinx

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
source=$work/tagrid
mkdir "$source"
# Documents are copied, because pages are added. Links lead to everything else.
for path in "$project"/*; do
  case "${path##*/}" in
    build|benchmark|paper-report) ;;
    docs|*.md) cp -a "$path" "$source" ;;
    *) ln -s "$path" "$source" ;;
  esac
done

# What doxygen finds in the headers, for Sphinx.
for language in c cpp; do
  mkdir "$work/$language"
  (cd "$project" && OUTPUT="$work/$language" doxygen "docs/reference/$language.doxygen") >/dev/null
  export "TAGRID_${language^^}_XML=$work/$language/xml"
done

"$python" -B -m sphinx -W --keep-going -q -j auto -b html -c "$source/docs" -d "$work/doctrees" "$source" "$folder"
cp "$folder/README.html" "$folder/index.html"
rm -f "$folder/.buildinfo" "$folder/objects.inv"
"$python" -B "$project/tools/documents/check_links.py" "$folder"
