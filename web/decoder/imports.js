// What a module may import from JavaScript (src/wasm.js), so that the linker does not miss it.
mergeInto(LibraryManager.library, { number: () => {} });
