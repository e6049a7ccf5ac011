import { resolve } from "node:path";
import { defineConfig } from "vitest/config";

// Every page and library is an entry. Names of entries are public: pages of others refer to them.
const ENTRIES = {
  viewer: "index.html",
  experiment: "experiment.html",
  "experiment-admin": "experiment-admin.html",
  "impasto-viewer": "src/impasto-viewer.ts",
};

export default defineConfig({
  resolve: {
    alias: [
      {
        find: /^numcodecs\/(blosc|lz4|zstd)$/,
        replacement: resolve(import.meta.dirname, "src/store/codec-left-out.ts"),
      },
    ],
  },
  base: "./", // a published folder may lie anywhere below a host
  build: {
    outDir: "../src/impasto/web",
    emptyOutDir: true,
    manifest: "manifest.json", // `impasto publish` copies what its page needs
    target: "es2022",
    assetsInlineLimit: 0, // the pages' content security policy allows no data: addresses but for pictures
    modulePreload: { polyfill: false },
    rolldownOptions: {
      input: ENTRIES,
      preserveEntrySignatures: "exports-only",
      output: {
        entryFileNames: "[name].js",
        chunkFileNames: "assets/[name]-[hash].js",
        assetFileNames: "assets/[name]-[hash][extname]",
      },
    },
  },
  test: { include: ["tests/**/*.test.ts"], environment: "node" },
});
