# Which tests the scripts leave out, repeat, or run with sanitizers: `ctest -L` and `-LE` select them by these labels. This
# file is read twice, each time with the names of `all_tests`: by CMake for scripts, and by CTest for the tests of programs,
# whose names are known only when they are built. CMake leaves out names with brackets or semicolons: they get no label.

# Labels the tests whose names match one of the expressions OF, and none of the expressions BUT.
function(label name)
  cmake_parse_arguments(PARSE_ARGV 1 label "" "" "OF;BUT")
  set(found ${all_tests})
  list(JOIN label_OF "|" expression)
  list(FILTER found INCLUDE REGEX "${expression}")
  if(label_BUT)
    list(JOIN label_BUT "|" expression)
    list(FILTER found EXCLUDE REGEX "${expression}")
  endif()
  if(NOT found)
    return()
  endif()
  if(CMAKE_PROJECT_NAME)
    set_property(TEST ${found} APPEND PROPERTY LABELS ${name})
  else()
    # CTest has no other command, and this one appends.
    set_tests_properties(${found} PROPERTIES LABELS ${name})
  endif()
endfunction()

# tools/test.sh leaves these out, and --long runs them. Each takes a minute or more: it searches for the least memory, encodes
# what is large, waits for a rank that is killed, or repeats a quicker one with other types and volumes.
label(slow
      OF "MemoryLimit(OfShapes)?\\.(IsKept(/narrow|ByEstimates|WhereTheGrid|WithOpenVdb|WithGzip)|ThatEncodingAccepts)"
         "^tools/(LargeVolume|Paper|MpiFaults.ARankThatIsKilled|RestoredFolder.GoesWithTheRunThatA)"
         "^plugins/ParaView$" "^docs/Site$"
         "OfALargeVolumeAre"
         "/(EstimatesOfType|MeshError|CoarsenedMesh|DerivedGridOfType).*<(signed char|unsigned short|unsigned int|int)>"
         "RealVolumes\\..*/(itk|ge_ct|foot|engine|vhf)"
         "EveryFlippedBit.*<(signed char|short|unsigned short|unsigned int|int|float)>")

# `tools/test.sh --quick` leaves these out as well. Together, they are two fifths of the time of the others.
label(thorough
      OF "^readers/(dicom|tiff|hdf5|zarr)_"
         "^readers/(solver_mesh|memory|lost|verdicts|values|plain_forms|spacing|nexus|series_names|n5|amira)$"
         "^readers/(metaimage|two_passes)$"
         "^tools/(Overviews|TwoRuns|Nameless|MemoryPlans|MpiNodes|Thresholds|Benchmark|Serve)$"
         "^tools/(MpiConvert.ARankThatIsKilled|Mpi.AnyNumberOfProcessesWritesTheSameOverviews)"
         "^python/(zarr|reader)$"
         "VoxelCodec.EveryVoxelWithinTheBound")

# With TAGRID_LONG, these try more.
label(longer
      OF SecondDecoder RealVolumes RealRates Fault EveryCall VdbReader readers/ MemoryLimit InstalledPrefix ReadingOnly systems/
         MemoryPlans "packages/(Static|OssFuzz)" web/Fuzz "python/(installed|wheel|reader)")

# ---- sanitizers, in every run of .ci/run

# Sanitizers find what a line does wrong, whatever the numbers; tools/test.sh proves these with more random volumes.
set(numbers "Real(Volumes|Rates)" OfTheLobster "SurfaceOfMesh.*/(2x2x2|9x9x9|13x|33x)" SmallestLimitOfMemory MetadataThatNoReader
            "MaterialMeshOfFile\\.(PartsAre|LeavesOut|ValuesFar|OfARegion)")
# Readers and decoders, on damaged input and on calls of the library.
label(asan
      OF "^(io|pipeline)/" "^readers/(dicom|tiff|hdf5|jp2|zarr)$"
      BUT ${numbers} LargeDamage "pipeline/.*<int>" pipeline/Sizes/ TheSameBytes OfAnySizeIsOpened)
# Commands that take what people write and send, broken or not. Their program is that of the build with sanitizers.
label(commands-asan
      OF "^tools/(BrokenFiles|Options|Numbers|Printable|RoundTrip|RegionOptions)"
         "^tools/(SurfaceCommand|SalvageCommand|PhantomCommand)")
# Threads meet in the same code for every type, number and geometry, and not at all in some tests of the same files.
label(tsan
      OF "^(pipeline|tsan)/"
      BUT ${numbers} "14x15x30 S 8" "<(short|int|double)>" "EveryMode<float>" DerivedGridOfType AreThoseOfTheOracle
          AwkwardVolumesHave AnyBoxHas EveryGeometry OneSpike EveryStretchOfRows HoldsOnAwkward ARunThatGoesOn DamagedFilesGive
          BoundsThatFollow AnAlignedChunk EveryTypeAndMode "21x6x25 S 4" SurfaceInWorld OrderFields
          RowOutputTest "MaterialMeshOfFile\\.(IsThatOf|Has|OfLabels|Infinities|IsMirrored)")

# ---- sanitizers, in tools/test.sh --long

label(every-asan OF "^(stages|io|pipeline|readers)/" BUT "Real(Volumes|Rates)" LargeDamage)
# Not forged files and plans, whose memory sanitizers change, nor commands that are killed, which report nothing.
label(every-command-asan
      OF "^tools/"
      BUT "tools/(Benchmark|Scale|Paper|Streams|Slurm|Documentation|Advice|ForgedFiles|MemoryPlans)" "/Kill\\."
          WideOpenVdbVolumes)
label(every-tsan OF "^(pipeline|tsan)/" BUT "Real(Volumes|Rates)" LargeDamage)
