// Glue between Jupyter widgets and the drawing code (core.js). unpackFrontEnd (unpack.js) stands before this text.
// Two kinds of model use it: the one front end of a kernel, which carries the drawing code and receives all messages,
// and the scenes, whose models hold their first state only. (A widget that anywidget cannot start within two seconds,
// on a page that is busy drawing the first scenes, never gets a message: so scenes do not depend on getting any.)

const page = (globalThis[Symbol.for("tutorialbot.viewers")] ??= { cores: new Map(), hubs: new Map() });
const KEPT = 300; // messages kept for a scene that has not started yet

function hubOf(channel) {
  if (!page.hubs.has(channel)) {
    const hub = { scenes: new Map(), early: new Map() };
    hub.core = new Promise((resolve, reject) => Object.assign(hub, { resolve, reject }));
    hub.receive = ({ scene, ...content }, buffers) => {
      const handle = hub.scenes.get(scene);
      if (handle) return handle(content, buffers);
      hub.early.set(scene, [...(hub.early.get(scene) ?? []), [content, buffers]].slice(-KEPT));
    };
    page.hubs.set(channel, hub);
  }
  return page.hubs.get(channel);
}

function startHub(model) {
  const hub = hubOf(model.get("channel")), hash = model.get("code_hash");
  model.on("msg:custom", hub.receive);
  if (!page.cores.has(hash)) {
    const core = new Promise((later) => setTimeout(later)).then(() => unpackFrontEnd(model.get("code")));
    core.catch(() => page.cores.delete(hash)); // so that a later kernel can try again
    page.cores.set(hash, core);
  }
  page.cores.get(hash).then(hub.resolve, hub.reject);
  return () => page.hubs.delete(model.get("channel"));
}

function startScene(model) {
  const hub = hubOf(model.get("channel")), name = model.get("scene");
  const store = hub.core.then(async (api) => {
    const scene = new api.Store((question) => model.send({ kind: question }));
    await scene.load(model.get("snapshot"));
    return scene;
  });
  let queue = store;
  const handle = (content, buffers) => {
    queue = queue.then(async () => (await store).receive(content, buffers)).catch(console.error);
  };
  hub.scenes.set(name, handle);
  for (const message of hub.early.get(name) ?? []) handle(...message);
  hub.early.delete(name);
  queue.then(() => model.send({ kind: "sequence?" })).catch(console.error);
  return { store, core: hub.core, end: () => hub.scenes.delete(name) };
}

export default () => {
  let scene;
  return {
    initialize({ model }) {
      if (!model.get("scene")) return startHub(model);
      scene = startScene(model);
      return scene.end;
    },
    async render({ el }) {
      const waiting = document.createElement("div");
      waiting.textContent = "drawing the scene …";
      waiting.style.cssText = "color:#8a94a6;font:12px sans-serif;padding:8px";
      el.append(waiting);
      try {
        const [api, store] = await Promise.all([scene.core, scene.store]);
        waiting.remove();
        const view = new api.SceneView(el, store);
        return () => view.dispose();
      } catch (error) {
        waiting.textContent = `The scene cannot be drawn here (${error}). Scene.png() and Scene.html() still work.`;
      }
    },
  };
};
