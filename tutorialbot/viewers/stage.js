// What surrounds the content of a scene: lights, floor, the player's controls, the style of all that is not 3-D.
// Evaluated as a CommonJS module; its export takes three.js and returns {lights, floor, Transport, STYLE}.

module.exports = (THREE) => {
  function lights(extent) {
    const group = new THREE.Group(), { center, radius } = extent;
    const key = new THREE.DirectionalLight(0xffffff, 0.52), fill = new THREE.DirectionalLight(0xdfe8ff, 0.2);
    for (const [light, toward] of [[key, extent.key], [fill, extent.fill]]) {
      light.position.set(...center.map((c, i) => c + 3.5 * radius * toward[i]));
      light.target.position.set(...center);
      group.add(light, light.target);
    }
    key.castShadow = true;
    key.shadow.mapSize.set(1024, 1024);
    key.shadow.radius = 3;
    key.shadow.bias = -0.0005;
    key.shadow.normalBias = 0.01 * radius;
    const reach = 1.25 * radius;
    Object.assign(key.shadow.camera, {
      left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * radius, far: 8 * radius,
    });
    const sky = new THREE.HemisphereLight(0xffffff, 0xc4ccd8, 0.47);
    sky.position.set(0, 0, 1);
    group.add(sky);
    return { group, key };
  }

  // A soft grid that fades out around the scene, and a surface that only takes shadows.
  function floor(extent) {
    const { center, radius } = extent, group = new THREE.Group(), reach = 4.5 * radius;
    const step = 10 ** Math.round(Math.log10(radius / 2)) / 2;
    const grid = new THREE.Mesh(
      new THREE.PlaneGeometry(2 * reach, 2 * reach),
      new THREE.ShaderMaterial({
        transparent: true, depthWrite: false, side: THREE.DoubleSide, extensions: { derivatives: true },
        uniforms: { reach: { value: reach }, step: { value: step } },
        vertexShader: `varying vec2 world; varying vec2 around;
          void main() { world = (modelMatrix * vec4(position, 1.0)).xz; around = position.xy;
            gl_Position = projectionMatrix * viewMatrix * modelMatrix * vec4(position, 1.0); }`,
        fragmentShader: `varying vec2 world; varying vec2 around; uniform float reach; uniform float step;
          float lines(float s) { vec2 g = abs(fract(world / s - 0.5) - 0.5) * s / fwidth(world);
            return 1.0 - min(min(g.x, g.y), 1.0); }
          void main() { float fade = 1.0 - smoothstep(0.25, 1.0, length(around) / reach);
            gl_FragColor = vec4(0.45, 0.5, 0.58, fade * (0.22 * lines(step) + 0.22 * lines(step * 5.0))); }`,
      }),
    );
    const shade = new THREE.Mesh(
      new THREE.PlaneGeometry(2 * reach, 2 * reach), new THREE.ShadowMaterial({ opacity: 0.22, depthWrite: false }),
    );
    shade.receiveShadow = true;
    group.add(shade, grid);
    group.position.set(center[0], center[1], extent.floor);
    return group;
  }

  // Time of the animation. meshcat's own animator loads the clips; the time is always set from here.
  class Transport {
    constructor(wake) {
      Object.assign(this, { wake, time: 0, speed: 1, playing: false, last: null, rounds: 1, paths: [] });
      this.bar = document.createElement("div");
      this.bar.className = "tb-bar";
      this.bar.innerHTML = `<button class="tb-play" title="play or pause"></button>
        <input type="range" min="0" step="any" value="0" class="tb-time" title="time"><span class="tb-clock"></span>
        <select class="tb-speed" title="speed"></select>`;
      [this.button, this.slider, this.clock, this.choice] = this.bar.children;
      this.button.onclick = () => (this.playing ? this.pause() : this.play());
      this.slider.oninput = () => {
        const time = Number(this.slider.value);
        this.pause();
        this.seek(time);
      };
      this.choice.onchange = () => (this.speed = Number(this.choice.value));
      this.show();
    }

    attach(viewer) {
      const animator = (this.animator = viewer.animator), load = animator.load.bind(animator);
      Object.assign(animator, { play: () => {}, pause: () => {}, update: () => {} });
      animator.load = (animations, options) => {
        this.paths = animations.map((animation) => "/" + animation.path.join("/"));
        load(animations, { ...options, play: false, loopMode: THREE.LoopOnce, repetitions: 1 });
        for (const action of animator.actions) action.play();
        this.rounds = options?.repetitions ?? 1;
        this.slider.max = animator.duration;
        this.speed = options?.speed ?? 1;
        const speeds = [...new Set([0.1, 0.25, 0.5, 1, 2, 4, this.speed])].sort((a, b) => a - b);
        this.choice.replaceChildren(...speeds.map((s) => new Option(`${s}×`, s, false, s === this.speed)));
        this.seek(0);
        if (options?.play ?? true) this.play();
      };
    }

    play() {
      if (this.time >= this.animator.duration) this.time = 0;
      Object.assign(this, { playing: true, last: null });
      this.show();
      this.wake();
    }

    pause() {
      this.playing = false;
      this.show();
    }

    advance(now) {
      const passed = this.last === null ? 0 : Math.min(0.1, (now - this.last) / 1000), end = this.animator.duration;
      this.last = now;
      let time = this.time + this.speed * passed;
      if (time >= end && --this.rounds > 0 && end > 0) time %= end;
      else if (time >= end) {
        this.rounds = 1;
        this.pause();
      }
      this.seek(time);
    }

    seek(time) {
      this.time = Math.min(Math.max(time, 0), this.animator.duration);
      this.animator.seek(this.time);
      this.show();
    }

    show() {
      const end = this.animator?.duration ?? 0;
      this.bar.style.display = end > 0 ? "flex" : "none";
      this.button.textContent = this.playing ? "❚❚" : "▶";
      this.button.setAttribute("aria-label", this.playing ? "pause" : "play");
      this.slider.value = this.time;
      this.clock.textContent = `${this.time.toFixed(2)} / ${end.toFixed(2)} s`;
    }
  }

  const STYLE = `.tb-scene{position:relative;width:100%;overflow:hidden;border-radius:6px;background:#eef0f3}
    .tb-scene canvas,.tb-pane{position:absolute;inset:0;width:100%;height:100%}
    .tb-pane{cursor:grab;outline:none}.tb-pane:active{cursor:grabbing}
    .tb-bar{position:absolute;left:10px;right:10px;bottom:8px;gap:8px;align-items:center;padding:3px 8px;
      background:#ffffffd0;border-radius:6px;font:12px system-ui,sans-serif;color:#334}
    .tb-bar input{flex:1;min-width:40px;accent-color:#3b7dd8}.tb-bar span{min-width:92px;text-align:right;
      font-variant-numeric:tabular-nums}
    .tb-scene button{border:0;border-radius:5px;background:#ffffffb0;color:#334;cursor:pointer;font-size:13px;
      min-width:28px;height:24px}.tb-scene button:hover{background:#fff}
    .tb-bar select{border:0;background:none;color:#334}
    .tb-corner{position:absolute;right:8px;top:8px;display:flex;gap:4px;opacity:0;transition:opacity .15s}
    .tb-scene:hover .tb-corner,.tb-corner:focus-within{opacity:1}
    .tb-hint{position:absolute;left:10px;top:8px;font:11px system-ui,sans-serif;color:#66708a;opacity:0;
      transition:opacity .2s;pointer-events:none;background:#ffffffb0;border-radius:4px;padding:2px 6px}
    .tb-hint.tb-on{opacity:1}`;

  return { lights, floor, Transport, STYLE };
};
