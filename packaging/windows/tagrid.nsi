; The installer of tagrid for Windows. tools/windows_package.sh calls it with VERSION, FOLDER (what is installed) and OUTPUT.
; It installs for all users, opens .tag files with the viewer by a double click, and can be undone. It does not change PATH.
Unicode true
Name "tagrid ${VERSION}"
OutFile "${OUTPUT}"
InstallDir "$PROGRAMFILES64\tagrid"
InstallDirRegKey HKLM "Software\tagrid" "Folder"
RequestExecutionLevel admin
SetCompressor /SOLID lzma
ShowInstDetails show

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

Section
  SetRegView 64
  SetOutPath "$INSTDIR"
  File /r "${FOLDER}/*"
  WriteUninstaller "$INSTDIR\uninstall.exe"
  WriteRegStr HKLM "Software\tagrid" "Folder" "$INSTDIR"
  WriteRegStr HKLM "${CLASSES}\.tag" "" "tagrid.volume"
  WriteRegStr HKLM "${CLASSES}\.tag" "Content Type" "application/vnd.tagrid"
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
  ; Only what was installed: a folder of the user may have this name.
  RMDir /r "$INSTDIR\bin"
  RMDir /r "$INSTDIR\share"
  Delete "$INSTDIR\README.md"
  Delete "$INSTDIR\LICENSE.txt"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR"
  ReadRegStr $0 HKLM "${CLASSES}\.tag" ""
  StrCmp $0 "tagrid.volume" 0 +2
    DeleteRegKey HKLM "${CLASSES}\.tag"
  DeleteRegKey HKLM "${CLASSES}\tagrid.volume"
  DeleteRegKey HKLM "Software\tagrid"
  DeleteRegKey HKLM "${UNINSTALL}"
  !insertmacro TypesChanged
SectionEnd
