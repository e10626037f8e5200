; The installer of tagrid for Windows. tools/windows_package.sh calls it with VERSION, FOLDER (what is installed), OUTPUT, and
; REMOVE, a file with a line that removes each installed file and folder.
; It installs for all users, opens .tag files with the viewer by a double click, and can be undone. It does not change PATH.
; Of 64 bits, as the program: it runs where nothing runs programs of 32 bits.
Target amd64-unicode
Name "tagrid ${VERSION}"
OutFile "${OUTPUT}"
InstallDir "$PROGRAMFILES64\tagrid"
RequestExecutionLevel admin
SetCompressor /SOLID lzma

!define CLASSES "Software\Classes"
!define UNINSTALL "Software\Microsoft\Windows\CurrentVersion\Uninstall\tagrid"

Page license
Page directory
Page instfiles
UninstPage uninstConfirm
UninstPage instfiles
LicenseData "${FOLDER}/LICENSE.txt"

; Shell32's SHChangeNotify: Explorer sees the new type of files.
!macro TypesChanged
  System::Call 'shell32::SHChangeNotify(i 0x08000000, i 0, p 0, p 0)'
!macroend

Function .onInit
  SetRegView 64
  ; An update goes where the last version is, unless /D names a folder.
  StrCmp $INSTDIR "$PROGRAMFILES64\tagrid" 0 done
  ReadRegStr $0 HKLM "Software\tagrid" "Folder"
  StrCmp $0 "" done
  StrCpy $INSTDIR $0
done:
FunctionEnd

Section
  SetRegView 64
  ; Files of others are never overwritten: the folder is new, empty, or has a tagrid.
  IfFileExists "$INSTDIR\uninstall.exe" update
  FindFirst $0 $1 "$INSTDIR\*.*"
next:
  StrCmp $1 "" empty
  StrCmp $1 "." more
  StrCmp $1 ".." more
  FindClose $0
  MessageBox MB_OK|MB_ICONSTOP "$INSTDIR is not empty. Choose a folder that is new." /SD IDOK
  Abort "$INSTDIR is not empty"
more:
  FindNext $0 $1
  Goto next
empty:
  FindClose $0
  Goto install
update:
  ; What the last version has and this one has not would stay otherwise.
  ExecWait '"$INSTDIR\uninstall.exe" /S _?=$INSTDIR'
install:
  SetOutPath "$INSTDIR"
  File /r "${FOLDER}/*"
  WriteUninstaller "$INSTDIR\uninstall.exe"
  WriteRegStr HKLM "Software\tagrid" "Folder" "$INSTDIR"
  ReadRegStr $0 HKLM "${CLASSES}\.tag" ""
  StrCmp $0 "tagrid.volume" +2
    WriteRegStr HKLM "Software\tagrid" "TypeBefore" $0
  WriteRegStr HKLM "${CLASSES}\.tag" "" "tagrid.volume"
  WriteRegStr HKLM "${CLASSES}\tagrid.volume" "" "CT volume of tagrid"
  WriteRegStr HKLM "${CLASSES}\tagrid.volume\shell\open\command" "" '"$INSTDIR\bin\tagrid.exe" view "%1"'
  WriteRegStr HKLM "${UNINSTALL}" "DisplayName" "tagrid"
  WriteRegStr HKLM "${UNINSTALL}" "DisplayVersion" "${VERSION}"
  WriteRegStr HKLM "${UNINSTALL}" "UninstallString" '"$INSTDIR\uninstall.exe"'
  WriteRegDWORD HKLM "${UNINSTALL}" "NoModify" 1
  WriteRegDWORD HKLM "${UNINSTALL}" "NoRepair" 1
  !insertmacro TypesChanged
SectionEnd

Section "Uninstall"
  SetRegView 64
  ; Each file that was installed, and folders that are empty then: nothing of the user.
  !include "${REMOVE}"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR"
  ; The type of .tag files is what it was before, unless another program has taken it since.
  ReadRegStr $0 HKLM "${CLASSES}\.tag" ""
  StrCmp $0 "tagrid.volume" 0 others
  ReadRegStr $1 HKLM "Software\tagrid" "TypeBefore"
  StrCmp $1 "" 0 before
  DeleteRegValue HKLM "${CLASSES}\.tag" ""
  Goto others
before:
  WriteRegStr HKLM "${CLASSES}\.tag" "" $1
others:
  DeleteRegKey /ifempty HKLM "${CLASSES}\.tag"
  DeleteRegKey HKLM "${CLASSES}\tagrid.volume"
  DeleteRegKey HKLM "Software\tagrid"
  DeleteRegKey HKLM "${UNINSTALL}"
  !insertmacro TypesChanged
SectionEnd
