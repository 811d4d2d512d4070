// Glue between one Jupyter widget and the drawing code (core.js), which the page keeps once for all scenes.
// A module of its own is made for every scene, so this file is small. unpackFrontEnd (unpack.js) stands before it.

const page = (globalThis[Symbol.for("tutorialbot.viewers")] ??= new Map());

function core(model) {
  const hash = model.get("front_end_hash");
  if (!page.has(hash)) {
    const ready = model.widget_manager
      .get_model(model.get("front_end"))
      .then((carrier) => unpackFrontEnd(carrier.get("code")));
    ready.catch(() => page.delete(hash)); // so that a later scene can try again
    page.set(hash, ready);
  }
  return page.get(hash);
}

export default () => {
  let store; // a promise of the scene's commands; every view of this model draws from it
  return {
    initialize({ model }) {
      store = core(model).then(async (api) => {
        const scene = new api.Store((question) => model.send({ kind: question }));
        await scene.load(model.get("snapshot"));
        return scene;
      });
      let queue = store;
      model.on("msg:custom", (content, buffers) => {
        queue = queue.then(async () => (await store).receive(content, buffers)).catch(console.error);
      });
      queue.then(() => model.send({ kind: "sequence?" })).catch(console.error);
    },
    async render({ model, el }) {
      const waiting = document.createElement("div");
      waiting.textContent = "drawing the scene …";
      waiting.style.cssText = "color:#8a94a6;font:12px sans-serif;padding:8px";
      el.append(waiting);
      try {
        const [api, scene] = await Promise.all([core(model), store]);
        waiting.remove();
        const view = new api.SceneView(el, scene);
        return () => view.dispose();
      } catch (error) {
        waiting.textContent = `The scene cannot be drawn here (${error}). Scene.png() and Scene.html() still work.`;
      }
    },
  };
};
