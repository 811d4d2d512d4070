// Draws recorded meshcat commands with meshcat's own viewer: many scenes on a page share one WebGL renderer, whose
// picture is copied to each scene's 2-D canvas (a page can have only about 16 WebGL contexts).
// Evaluated as a CommonJS module; its export takes meshcat and the exports of stage.js and store.js.

module.exports = ({ Viewer, THREE }, makeStage, Store) => {
  const { lights, floor, Transport, STYLE } = makeStage(THREE);
  // One renderer and one loop for the page.
  const page = {
    renderer: null, width: 0, height: 0, views: new Set(), asked: false,

    start() {
      if (this.renderer) return;
      const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
      renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      renderer.shadowMap.enabled = true;
      renderer.shadowMap.type = THREE.PCFSoftShadowMap;
      renderer.setScissorTest(true);
      const redraw = () => this.views.forEach((view) => view.dirty());
      renderer.domElement.addEventListener("webglcontextrestored", redraw);
      this.renderer = renderer;
    },

    draw(view) {
      const { renderer } = this, [w, h] = view.size, ratio = renderer.getPixelRatio();
      if (w > this.width || h > this.height) {
        this.width = Math.max(w, this.width);
        this.height = Math.max(h, this.height);
        renderer.setSize(this.width, this.height, false);
      }
      renderer.setViewport(0, 0, w, h);
      renderer.setScissor(0, 0, w, h);
      view.viewer.render();
      const [pw, ph] = [Math.floor(w * ratio), Math.floor(h * ratio)];
      if (view.canvas.width !== pw || view.canvas.height !== ph) Object.assign(view.canvas, { width: pw, height: ph });
      const source = renderer.domElement;
      view.canvas.getContext("2d").drawImage(source, 0, source.height - ph, pw, ph, 0, 0, pw, ph);
    },

    request() {
      if (this.asked) return;
      this.asked = true;
      requestAnimationFrame((now) => {
        for (const view of this.views) if (view.visible && view.viewer) view.tick(now);
        const took = performance.now() - now; // where drawing is slow, leave half of the time to the page
        setTimeout(() => {
          this.asked = false;
          if ([...this.views].some((view) => view.waiting())) this.request();
        }, took > 15 ? took : 0);
      });
    },
  };

  // meshcat and its control panel listen to the window's size and take window.onload; a scene has a size of its own.
  function leavingWindowAlone(action) {
    const { onload } = window, own = window.addEventListener;
    window.addEventListener = function (type, ...rest) {
      if (type !== "resize") own.call(window, type, ...rest);
    };
    try {
      return action();
    } finally {
      delete window.addEventListener;
      if (window.addEventListener !== own) window.addEventListener = own;
      window.onload = onload;
    }
  }

  class SceneView {
    constructor(el, store) {
      Object.assign(this, { store, visible: false, viewer: null, size: [0, 0] });
      this.root = document.createElement("div");
      this.root.className = "tb-scene";
      this.root.setAttribute("data-lm-suppress-shortcuts", "true");
      this.root.innerHTML = `<style>${STYLE}</style><canvas></canvas><div class="tb-pane" tabindex="0"></div>
        <div class="tb-corner"><button title="back to the first view">⌂</button><button title="full screen">⛶</button>
        </div><div class="tb-hint">click the scene to zoom with the wheel</div>`;
      el.append(this.root);
      [this.canvas, this.pane, this.hint] = ["canvas", ".tb-pane", ".tb-hint"].map((s) => this.root.querySelector(s));
      const [home, full] = this.root.querySelectorAll(".tb-corner button");
      home.onclick = () => this.look();
      full.onclick = () => (document.fullscreenElement ? document.exitFullscreen() : this.root.requestFullscreen());
      this.transport = new Transport(() => page.request());
      this.root.append(this.transport.bar);
      this.root.style.height = typeof store.view.height === "number" ? `${store.view.height}px` : "100%";
      this.resizing = new ResizeObserver(() => this.resize());
      this.watching = new IntersectionObserver(([entry]) => this.show(entry.isIntersecting), { rootMargin: "100px" });
      this.resizing.observe(this.root);
      this.watching.observe(this.root);
      this.wheel();
      page.views.add(this);
      store.views.add(this);
    }

    // The wheel scrolls the page until the scene has been clicked; leaving the scene gives it back.
    wheel() {
      const zoom = (on) => {
        this.zooming = on;
        if (this.viewer) this.viewer.controls.enableZoom = on;
        if (on) this.hint.classList.remove("tb-on");
      };
      this.pane.addEventListener("pointerdown", () => zoom(true));
      this.root.addEventListener("pointerleave", (event) => event.buttons || zoom(false));
      this.pane.addEventListener("wheel", () => {
        if (this.zooming) return;
        this.hint.classList.add("tb-on");
        clearTimeout(this.hiding);
        this.hiding = setTimeout(() => this.hint.classList.remove("tb-on"), 1200);
      }, { passive: true });
      this.zooming = false;
    }

    show(visible) {
      this.visible = visible;
      if (visible && !this.viewer) this.build();
      else if (!visible && this.key?.shadow.map) {
        this.key.shadow.map.dispose();
        this.key.shadow.map = null;
      }
      this.transport.last = null;
      this.dirty();
    }

    build() {
      try {
        page.start();
      } catch (error) {
        this.hint.textContent = `no 3-D here: WebGL is off or missing (${error.message}); Scene.png() still works`;
        this.hint.classList.add("tb-on");
        return;
      }
      leavingWindowAlone(() => {
        const viewer = new Viewer(this.pane, false, page.renderer);
        viewer.gui.domElement.remove();
        viewer.set_3d_pane_size = () => this.resize();
        viewer.set_dirty = () => this.dirty();
        viewer.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
        for (const name of Object.keys(viewer.scene_tree.find(["Lights"]).children)) {
          viewer.delete_path(["Lights", name]);
        }
        viewer.set_property(["Axes"], "visible", false);
        viewer.set_property(["Background"], "top_color", [0.97, 0.975, 0.985]);
        viewer.set_property(["Background"], "bottom_color", [0.8, 0.825, 0.86]);
        this.viewer = viewer;
      });
      this.transport.attach(this.viewer);
      this.viewer.controls.addEventListener("start", () => (this.touched = true));
      this.arrange(true);
      this.restart();
    }

    // Lights, floor and camera for the extent that the kernel computed; a camera that the reader moved stays.
    arrange(move) {
      if (!this.viewer) return;
      const { group, key } = lights(this.store.view);
      this.key = key;
      leavingWindowAlone(() => {
        this.viewer.set_object(["Lights", "All"], group);
        this.viewer.set_object(["Grid"], floor(this.store.view));
      });
      if (move || !this.touched) this.look();
    }

    look() {
      if (!this.viewer) return;
      this.touched = false;
      const { camera, target, radius } = this.store.view, { viewer } = this, up = ([x, y, z]) => [x, z, -y];
      Object.assign(viewer.camera, { fov: 32, near: 0.02 * radius, far: 60 * radius });
      viewer.camera.position.set(...up(camera));
      viewer.controls.target.set(...up(target));
      viewer.controls.enableZoom = this.zooming;
      this.resize();
    }

    restart() {
      if (!this.viewer) return;
      leavingWindowAlone(() => this.viewer.delete_path(["meshcat"]));
      this.viewer.animator.clear();
      this.transport.pause();
      this.handle([...this.store.entries.values()], false);
      this.resize();
    }

    handle(items, live) {
      if (!this.viewer) return;
      leavingWindowAlone(() => {
        for (const { key: [kind, path], body } of items) {
          if (kind === "set_transform" && this.transport.playing && this.transport.paths.includes(path)) {
            this.transport.pause(); // a live pose wins over a running animation
          }
          try {
            this.viewer.handle_command_bytearray(body);
            if (kind === "set_object") this.soften(path);
          } catch (error) {
            console.error(`meshcat could not handle ${kind} ${path}:`, error);
          }
        }
      });
      this.dirty();
    }

    // What is seen through casts no shadow.
    soften(path) {
      const parts = path.split("/").filter((part) => part.length);
      this.viewer.scene_tree.find(parts.concat("<object>")).object.traverse((node) => {
        if (node.material?.transparent) node.castShadow = false;
      });
    }

    resize() {
      const [w, h] = [this.root.clientWidth, this.root.clientHeight];
      if (!this.viewer || !w || !h) return;
      this.size = [w, h];
      this.viewer.camera.aspect = w / h;
      this.viewer.camera.updateProjectionMatrix();
      this.dirty();
    }

    dirty() {
      if (this.viewer) this.viewer.needs_render = true;
      page.request();
    }

    tick(now) {
      if (this.transport.playing) this.transport.advance(now);
      if (this.viewer.needs_render && this.size[0]) page.draw(this);
    }

    waiting() {
      return this.visible && this.viewer && (this.transport.playing || (this.viewer.needs_render && this.size[0]));
    }

    dispose() {
      page.views.delete(this);
      this.store.views.delete(this);
      this.resizing.disconnect();
      this.watching.disconnect();
      if (this.viewer) {
        leavingWindowAlone(() => this.viewer.delete_path(["meshcat"]));
        this.viewer.scene.traverse((node) => {
          node.geometry?.dispose();
          node.shadow?.map?.dispose();
        });
        this.viewer.controls.dispose();
        this.viewer.gui.destroy();
      }
      this.root.remove();
    }
  }

  return { Store, SceneView };
};
