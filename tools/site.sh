#!/usr/bin/env bash
# Builds the site of the documents, with references of Python, C, C++ and JavaScript, in a folder that is new or empty:
#   tools/site.sh FOLDER
# Open FOLDER/index.html: no server is needed. A broken link or anchor is an error.
# tools/install_packages.sh site installs what it needs, except npm's typedoc and typedoc-plugin-markdown, which it takes
# from $TAGRID_NODE_MODULES. Without these, it says so, and the reference of JavaScript is the file of declarations.
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
"$python" -B "$source/docs/reference/headers.py" "$project/include" "$source/docs/reference"

# What typedoc finds in the declarations of the package for browsers, as a page.
modules=${TAGRID_NODE_MODULES:-}
if [ -x "$modules/.bin/typedoc" ] && [ -d "$modules/typedoc-plugin-markdown" ]; then
  mkdir "$work/javascript"
  ln -s "$(realpath "$modules")" "$work/javascript/node_modules"
  cp "$project/docs/reference/typedoc.json" "$project/web/decoder/src/index.d.ts" "$work/javascript"
  cd "$work/javascript"
  echo '{"compilerOptions": {"lib": ["ES2022", "DOM"], "target": "ES2022"}, "files": ["index.d.ts"]}' >tsconfig.json
  node_modules/.bin/typedoc
  # The constructors of JavaScript's own Error are left out.
  sed '/^#### Constructors/,/^#### Properties/{/^#### Properties/!d}' out/README.md >"$source/docs/reference/javascript.md"
  rm "$source/docs/reference/javascript.rst"
else
  echo "$0: there is no typedoc in TAGRID_NODE_MODULES, so the reference of JavaScript is its file of declarations" >&2
fi

"$python" -B -m sphinx -W --keep-going -q -j auto -b html -c "$source/docs" -d "$work/doctrees" "$source" "$folder"
cp "$folder/README.html" "$folder/index.html"
rm -f "$folder/.buildinfo" "$folder/objects.inv"
"$python" -B "$project/tools/documents/check_links.py" "$folder"
