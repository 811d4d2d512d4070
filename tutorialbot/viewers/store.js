// The commands of a scene in the page, as log.py has them in the kernel. Evaluated as a CommonJS module.

const below = (path, root) => path === root || path.startsWith(root + "/");

async function unzip(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function split(keys, sizes, bytes, from) {
  let at = from;
  return keys.map((key, i) => ({ key, body: bytes.subarray(at, (at += sizes[i])) }));
}

const bytesOf = (view) => new Uint8Array(view.buffer ?? view, view.byteOffset ?? 0, view.byteLength);

// The last command for each key, as in log.py, so that a second view needs no kernel.
class Store {
  constructor(ask) {
    Object.assign(this, { ask, entries: new Map(), views: new Set(), view: {}, sequence: -1 });
  }

  async load(snapshot) {
    const bytes = await unzip(bytesOf(snapshot));
    const length = new DataView(bytes.buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    this.entries = new Map(
      split(header.keys, header.sizes, bytes, 4 + length).map((item) => [item.key.join("\n"), item]),
    );
    Object.assign(this, { sequence: header.sequence, view: header.view });
    for (const view of this.views) view.restart();
  }

  async receive(content, buffers) {
    if (content.kind === "snapshot") {
      await this.load(buffers[0]);
    } else if (content.kind === "view") {
      this.view = content.view;
      for (const view of this.views) view.arrange(content.move);
    } else if (content.kind === "sequence") {
      if (content.sequence > this.sequence) this.ask("snapshot?");
    } else if (content.kind === "commands" && content.sequence > this.sequence) {
      if (content.sequence > this.sequence + 1) this.ask("snapshot?");
      this.sequence = content.sequence;
      const items = split(content.keys, content.sizes, bytesOf(buffers[0]).slice(), 0);
      for (const item of items) this.keep(item);
      for (const view of this.views) view.handle(items, true);
    }
  }

  keep(item) {
    const [kind, path] = item.key;
    if (kind === "delete") {
      for (const [name, other] of this.entries) if (below(other.key[1], path)) this.entries.delete(name);
    }
    this.entries.delete(item.key.join("\n"));
    if (kind !== "delete" || !below(path, "/meshcat")) this.entries.set(item.key.join("\n"), item);
  }
}

module.exports = Store;
