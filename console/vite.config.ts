import {defineConfig} from 'vite';

export default defineConfig({
  esbuild: {jsx: 'automatic', jsxImportSource: 'preact'},
  // Nothing inline: the server's content security policy forbids it.
  build: {assetsInlineLimit: 0, modulePreload: {polyfill: false}, chunkSizeWarningLimit: 900, emptyOutDir: true},
});
