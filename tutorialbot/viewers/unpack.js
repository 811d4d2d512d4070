// Makes the drawing code of its gzipped bytes; used by a notebook's widget and by an offline page.
async function unpackFrontEnd(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const parts = JSON.parse(await new Response(stream).text());
  const load = (source) => {
    const module = { exports: {} };
    // The body of a plain function, with no `define`: meshcat's bundle then takes its CommonJS branch.
    new Function("module", "exports", "define", source).call(globalThis, module, module.exports, undefined);
    return module.exports;
  };
  return load(parts.core)(load(parts.meshcat), load(parts.stage), load(parts.store));
}
