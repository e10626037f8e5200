# Completion of tagrid for bash; to be installed as bash-completion/completions/tagrid.

_tagrid_options() {
  local run='-h --help -T --threads -q --quiet -v --verbose --progress --json'
  local output='-o --output -f --force' removal='-k --keep --rm' memory='-M --memory'
  local headerless='--dims --type --endian --offset'
  local source="$headerless --spacing --override-spacing --from --series --dataset --gaps-ok --data-outside --vdb-grid"
  local error='--max-error --relative-error --psnr --ratio --bits'
  local encoding="$source --strip --surface-error --grid-only --grid --overviews --mesh-error --effort --accuracy
    --cube --lead --max-level --range --field-scale --brick"
  case $1 in
    encode) echo "$run $memory --spool $output $removal $error $encoding --parity --resume --trust-description" ;;
    decode) echo "$run $memory --spool $output $removal --format --region --volume --overview --step --samples --values --salvage --fill --vdb-grid
      --vdb-type --vdb-background --vdb-tolerance" ;;
    info) echo "$run $memory --no-levels" ;;
    verify) echo "$run $memory --spool $source --against -f --force" ;;
    repair) echo "-h --help -T --threads -q --quiet -v --verbose --progress $memory $output" ;;
    protect) echo "-h --help -T --threads -q --quiet -v --verbose --progress $memory --parity --beside -f --force" ;;
    restore) echo "$run $memory $output --records" ;;
    mesh) echo "$run $memory $output --level --region --volume --coarsen --samples --padded" ;;
    surface) echo "$run $memory $output --iso --samples --level --region --volume --close" ;;
    preview) echo "$run $memory $output --slice --volume --window" ;;
    view) echo "-h --help -q --quiet --port --no-browser" ;;
    serve) echo "-h --help -q --quiet --port --origin --volume" ;;
    convert)
      echo "$run $memory --spool $error $encoding --parity --manifest --find --output-dir --keep-folders --shard --skip-done
        --remove-verified --trust-description -f --force"
      ;;
    estimate) echo "$run $memory --spool $encoding --errors --psnr --ratio --bits -f --force" ;;
    formats) echo "-h --help --json -v --verbose" ;;
    phantom) echo "$run $output --dims --type --seed --format" ;;
    *) echo "-h --help -V --version" ;;
  esac
}

_tagrid() {
  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command='' word
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word != -* ]] && command=$word && break
  done
  COMPREPLY=()
  # --option=value comes as three words.
  [[ $current == = ]] && current=''
  [[ $before == = ]] && before=${COMP_WORDS[COMP_CWORD - 2]}
  local values=''
  case $before in
    --progress) values='auto bar plain none' ;;
    --format) values='nrrd nhdr raw vdb nifti nifti.gz metaimage mhd tiff vti vtkhdf hdf5 zarr' ;;
    --vdb-type) values='float int32' ;;
    --grid) values='stored derived' ;;
    --effort) values='fast default best' ;;
    --endian) values='little big' ;;
    --range) values='auto' ;;
    --type) values='uint8 int8 uint16 int16 uint32 int32 float32 float64' ;;
  esac
  if [[ -n $values ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$current")
    return
  fi
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(_tagrid_options "$command")" -- "$current")
  elif [[ -z $command ]]; then
    mapfile -t COMPREPLY < <(compgen -W 'encode decode info verify repair protect restore mesh surface preview view serve convert estimate formats phantom' -- "$current")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}

complete -o filenames -F _tagrid tagrid tagrid-mpi
