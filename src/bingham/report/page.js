// Draws the content of a report page. Quaternions are Hamilton, body to world; the world's third axis is vertical.
"use strict";
(() => {
  const content = JSON.parse(document.getElementById("content").textContent);
  const colours = ["#0072B2", "#009E73", "#D55E00", "#888888"];
  const axisColours = ["#D55E00", "#009E73", "#0072B2"];
  const MISSING = -32768;
  const element = (id) => document.getElementById(id);

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const time = new Float64Array(bytes(content.time));
  const orientation = new Int16Array(bytes(content.orientation));
  const truth = content.truth ? new Int16Array(bytes(content.truth)) : null;
  const covariance = new Float32Array(bytes(content.covariance));
  const duration = time[time.length - 1];
  let now = 0, playing = false;

  function values(curve) {
    const coded = new Int16Array(bytes(curve.value));
    return Array.from(coded, (v) => (v === MISSING ? null : v * curve.scale + curve.offset));
  }

  // The last sample at or before time t.
  function at(t) {
    let low = 0, high = time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (time[middle] <= t) low = middle; else high = middle - 1;
    }
    return low;
  }

  // Summary and warnings.
  for (const [name, value] of Object.entries(content.summary)) {
    const pair = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name; dd.textContent = value; pair.append(dt, dd); element("summary").append(pair);
  }
  for (const text of content.warnings) {
    const item = document.createElement("li"); item.textContent = text; element("warnings").append(item);
  }
  element("legend").innerHTML = ["x", "y", "z"].map((n, k) => `<b style="color:${axisColours[k]}">${n}</b>`).join(" ") +
    " of the body; points: where they may be (drawn from the covariance)" + (truth ? "; thin: ground truth" : "") + ". World: ";
  element("legend").append(content.world.join(", ") + ", the last one upwards. Drag to look from elsewhere." +
    (content.rejected.length ? " Ticks below the curves: rejected measurements." : ""));

  // Quaternion at time t: interpolated between kept samples, null where unknown.
  function quaternionAt(rows, t) {
    const k = at(t), n = Math.min(k + 1, time.length - 1);
    const a = Array.from(rows.subarray(4 * k, 4 * k + 4)), b = Array.from(rows.subarray(4 * n, 4 * n + 4));
    if (!a.some((v) => v)) return null;
    if (!b.some((v) => v)) return a.map((v) => v / 32767);
    const span = time[n] - time[k], share = span > 0 ? (t - time[k]) / span : 0;
    const sign = a.reduce((s, v, i) => s + v * b[i], 0) < 0 ? -1 : 1;
    const q = a.map((v, i) => (1 - share) * v + share * sign * b[i]);
    const norm = Math.hypot(...q);
    return q.map((v) => v / norm);
  }

  // 3-D view; world (x, y, z up) is drawn as three.js' (x, z, −y) by turning the root group.
  let view = null;
  function makeView() {
    const place = element("scene");
    let renderer;
    try {
      renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    } catch (error) {
      place.innerHTML = "<p>This browser shows no 3-D graphics (WebGL); the curves tell the same.</p>";
      return null;
    }
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    place.append(renderer.domElement);
    const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(35, 1, 0.1, 50);
    scene.add(new THREE.AmbientLight(0xffffff, 1.6));
    const lamp = new THREE.DirectionalLight(0xffffff, 1.8); lamp.position.set(3, 5, 4); scene.add(lamp);
    const world = new THREE.Group(); world.rotation.x = -Math.PI / 2; scene.add(world);
    const grid = new THREE.GridHelper(4, 8, 0x8899aa, 0x8899aa);
    grid.rotation.x = Math.PI / 2; grid.position.z = -1.15; grid.material.transparent = true; grid.material.opacity = 0.35; world.add(grid);
    const body = new THREE.Group(); world.add(body);
    body.add(new THREE.Mesh(new THREE.BoxGeometry(1.0, 0.62, 0.18), new THREE.MeshLambertMaterial({ color: 0x9aa4af })));
    const directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const arrow = (group, direction, colour, radius) => {
      const material = new THREE.MeshLambertMaterial({ color: colour });
      const shaft = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, 1.0, 12), material);
      const head = new THREE.Mesh(new THREE.ConeGeometry(3 * radius, 0.14, 16), material);
      shaft.position.y = 0.5; head.position.y = 1.05;
      const part = new THREE.Group(); part.add(shaft, head);
      part.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...direction));
      group.add(part);
    };
    directions.forEach((d, k) => arrow(body, d, axisColours[k], 0.022));
    const ghost = new THREE.Group();
    directions.forEach((d, k) => arrow(ghost, d, axisColours[k], 0.007));
    if (truth) world.add(ghost);
    const COUNT = 120, normals = [];
    let seed = 1;
    const uniform = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
    for (let i = 0; i < 3 * COUNT; i++) normals.push(Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform()));
    const clouds = axisColours.map((colour) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * COUNT), 3));
      const points = new THREE.Points(geometry, new THREE.PointsMaterial({ color: colour, size: 0.035, transparent: true, opacity: 0.75 }));
      points.frustumCulled = false; world.add(points); return points;
    });
    let azimuth = 0.7, height = 0.45;
    const look = () => {
      camera.position.set(5.2 * Math.cos(height) * Math.sin(azimuth), 5.2 * Math.sin(height), 5.2 * Math.cos(height) * Math.cos(azimuth));
      camera.lookAt(0, 0, 0); renderer.render(scene, camera);
    };
    const resize = () => {
      const w = place.clientWidth, h = place.clientHeight;
      renderer.setSize(w, h); camera.aspect = w / h; camera.updateProjectionMatrix(); look();
    };
    new ResizeObserver(resize).observe(place);
    let held = null;
    place.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; place.setPointerCapture(e.pointerId); });
    place.addEventListener("pointermove", (e) => {
      if (!held) return;
      azimuth -= 0.008 * (e.clientX - held[0]); height = Math.max(-1.5, Math.min(1.5, height + 0.008 * (e.clientY - held[1])));
      held = [e.clientX, e.clientY]; look();
    });
    place.addEventListener("pointerup", () => { held = null; });

    // Axes of samples exp(e) ⊗ q, e ~ N(0, C), world axes.
    function drawCloud(q, c) {
      const l = cholesky(c), base = new THREE.Quaternion(q[1], q[2], q[3], q[0]), turn = new THREE.Quaternion(), v = new THREE.Vector3();
      for (let i = 0; i < COUNT; i++) {
        const [a, b, d] = normals.slice(3 * i, 3 * i + 3);
        v.set(l[0] * a, l[1] * a + l[2] * b, l[3] * a + l[4] * b + l[5] * d);
        const angle = v.length();
        turn.setFromAxisAngle(angle > 0 ? v.divideScalar(angle) : v.set(0, 0, 1), angle).multiply(base);
        directions.forEach((direction, k) => {
          v.set(...direction).multiplyScalar(1.12).applyQuaternion(turn);
          clouds[k].geometry.attributes.position.setXYZ(i, v.x, v.y, v.z);
        });
      }
      clouds.forEach((cloud) => { cloud.geometry.attributes.position.needsUpdate = true; });
    }
    return {
      body,
      show(q, c, true_) {
        body.visible = q !== null; clouds.forEach((cloud) => { cloud.visible = q !== null && c !== null; });
        ghost.visible = Boolean(true_);
        if (q) body.quaternion.set(q[1], q[2], q[3], q[0]);
        if (true_) ghost.quaternion.set(true_[1], true_[2], true_[3], true_[0]);
        if (q && c) drawCloud(q, c);
        look();
      },
    };
  }

  // Lower triangle of the Cholesky factor of (xx, xy, xz, yy, yz, zz).
  function cholesky([xx, xy, xz, yy, yz, zz]) {
    const root = (v) => Math.sqrt(Math.max(v, 0)), over = (a, b) => (b > 0 ? a / b : 0);
    const a = root(xx), b = over(xy, a), c = root(yy - b * b), d = over(xz, a), e = over(yz - b * d, c);
    return [a, b, c, d, e, root(zz - d * d - e * e)];
  }

  function covarianceAt(t) {
    if (!content.cloud.length) return null;
    const k = at(t);
    let low = 0, high = content.cloud.length - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; if (content.cloud[middle] <= k) low = middle; else high = middle - 1; }
    const c = Array.from(covariance.subarray(6 * low, 6 * low + 6));
    return c.every(Number.isFinite) ? c : null;
  }

  // Curves.
  const plots = [];
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  let range = [0, duration];
  // Lines that end at a jump from 180° to −180°: the usual ones join all that falls on one column of pixels.
  function broken(u, index, first, last) {
    const stroke = new Path2D(), x = u.data[0], y = u.data[index];
    let drawing = false;
    for (let i = first; i <= last; i++) {
      if (y[i] === null || y[i] === undefined) { drawing = false; continue; }
      const right = u.valToPos(x[i], "x", true), up = u.valToPos(y[i], "y", true);
      if (drawing) stroke.lineTo(right, up); else stroke.moveTo(right, up);
      drawing = true;
    }
    return { stroke, fill: null, clip: null, flags: 1 };
  }

  function makePlots() {
    while (plots.length) plots.pop().destroy();
    element("plots").replaceChildren();
    const sync = uPlot.sync("report");
    for (const panel of content.panels) {
      const place = document.createElement("div"), heading = document.createElement("h2");
      place.className = "panel"; heading.textContent = `${panel.title} [${panel.unit}]`;
      place.append(heading); element("plots").append(place);
      const series = [{ label: "time", value: (_, v) => (v === null ? "–" : v.toFixed(2) + " s") }], data = [Array.from(time)], bands = [];
      for (const curve of panel.curves) {
        const colour = colours[curve.colour], edge = curve.band !== "";
        data.push(values(curve));
        series.push({
          label: curve.name || "lower edge", stroke: edge ? colour + "66" : colour, width: edge ? 0.6 : 1.1, dash: curve.dash ? [4, 4] : undefined,
          points: { show: false }, spanGaps: false, value: (_, v) => (v === null || v === undefined ? "–" : v.toPrecision(4) + panel.unit),
          fill: curve.band === "zero" ? colour + "33" : undefined, paths: curve.wraps ? broken : undefined,
        });
        if (curve.band === "lower") bands.push({ series: [series.length - 2, series.length - 1], fill: colour + "2e" });
      }
      const axis = { stroke: style("--ink"), grid: { stroke: style("--grid"), width: 1 }, ticks: { stroke: style("--grid") } };
      const plot = new uPlot({
        width: place.clientWidth - 10, height: 210, series, bands,
        scales: { x: { time: false, min: range[0], max: range[1] }, y: panel.range ? { range: yRange(panel.range) } : {} },
        axes: [{ ...axis, size: 34 }, { ...axis, size: 56 }],
        cursor: { sync: { key: sync.key, setSeries: false }, drag: { x: true, y: false } },
        legend: { show: panel.curves.length < 8 },
        hooks: {
          drawClear: [shade],
          draw: [mark],
          setScale: [(u, key) => { if (key === "x") zoomAll(u.scales.x.min, u.scales.x.max); }],
        },
      }, data, place);
      place.querySelectorAll(".u-legend .u-series").forEach((row) => { if (row.textContent.startsWith("lower edge")) row.style.display = "none"; });
      plot.over.addEventListener("click", () => { if (plot.cursor.left >= 0 && plot.select.width < 2) setTime(plot.posToVal(plot.cursor.left, "x")); });
      plots.push(plot);
    }
  }
  // The whole recording is scaled by its steady part; zoomed in, the curves fill the panel.
  function yRange(steady) {
    return (u, low, high) => {
      const [from, to] = u.series[0].idxs || [0, time.length - 1];  // what will be seen; u.scales.x is still what was
      const whole = from === 0 && to === time.length - 1;
      if (whole || low === null) return steady;
      const margin = 0.08 * (high - low) || 0.05;
      return [low - margin, high + margin];
    };
  }
  let zooming = false;
  function zoomAll(min, max) {
    if (zooming) return;
    zooming = true; range = [min, max];
    for (const plot of plots) if (plot.scales.x.min !== min || plot.scales.x.max !== max) plot.setScale("x", { min, max });
    zooming = false;
  }
  // Gaps dark, samples that do not count in an error light.
  function shade(u) {
    const fill = (runs, colour) => {
      u.ctx.fillStyle = colour;
      for (const [from, to] of runs) {
        const a = Math.max(u.valToPos(from, "x", true), u.bbox.left), b = Math.min(u.valToPos(to, "x", true), u.bbox.left + u.bbox.width);
        if (b > a) u.ctx.fillRect(a, u.bbox.top, b - a, u.bbox.height);
      }
    };
    u.ctx.save(); fill(content.unscored, "rgba(140, 150, 160, 0.12)"); fill(content.gaps, "rgba(204, 121, 167, 0.30)"); u.ctx.restore();
  }
  // Rejected measurements as ticks at the lower edge, and where the body is.
  function mark(u) {
    const { ctx, bbox } = u;
    ctx.save(); ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
    ctx.strokeStyle = "#CC79A7"; ctx.beginPath();
    for (const t of content.rejected) { const x = u.valToPos(t, "x", true); ctx.moveTo(x, bbox.top + bbox.height); ctx.lineTo(x, bbox.top + bbox.height - 7); }
    ctx.stroke();
    ctx.strokeStyle = style("--ink"); ctx.lineWidth = 1.2; ctx.beginPath();
    const x = u.valToPos(now, "x", true); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke(); ctx.restore();
  }

  function setTime(t) {
    now = Math.max(0, Math.min(duration, t));
    element("slider").value = duration > 0 ? now / duration : 0;
    element("clock").value = now.toFixed(2) + " s";
    if (view) view.show(quaternionAt(orientation, now), covarianceAt(now), truth ? quaternionAt(truth, now) : null);
    for (const plot of plots) plot.redraw(false, false);
  }
  let last = 0;
  function tick(stamp) {
    if (!playing) return;
    const step = Math.min(0.2, (stamp - last) / 1000) * Number(element("speed").value);
    last = stamp; setTime(now + step);
    if (now >= duration) play(false); else requestAnimationFrame(tick);
  }
  function play(on) {
    playing = on; element("play").textContent = on ? "❚❚" : "▶";
    if (on) { if (now >= duration) now = 0; last = performance.now(); requestAnimationFrame(tick); }
  }
  function theme(dark) { document.documentElement.classList.toggle("dark", dark); makePlots(); setTime(now); }

  element("play").addEventListener("click", () => play(!playing));
  element("slider").addEventListener("input", (e) => setTime(Number(e.target.value) * duration));
  element("theme").addEventListener("click", () => theme(!document.documentElement.classList.contains("dark")));
  document.addEventListener("keydown", (e) => {
    if (["SELECT", "INPUT"].includes(e.target.tagName) && e.target.id !== "slider") return;
    const step = (range[1] - range[0]) * (e.shiftKey ? 0.05 : 0.005);
    const act = { " ": () => play(!playing), ArrowLeft: () => setTime(now - step), ArrowRight: () => setTime(now + step), Home: () => setTime(0),
      End: () => setTime(duration), d: () => element("theme").click() }[e.key];
    if (act) { e.preventDefault(); if (e.target.id === "play" || e.target.id === "theme") e.target.blur(); act(); }
  });
  let width = window.innerWidth;
  window.addEventListener("resize", () => {
    if (window.innerWidth === width) return;
    width = window.innerWidth;
    for (const plot of plots) plot.setSize({ width: plot.root.parentElement.clientWidth - 10, height: 210 });
  });

  view = makeView();
  theme(window.matchMedia("(prefers-color-scheme: dark)").matches);
  window.binghamReport = {
    setTime, get now() { return now; }, get range() { return range; }, zoom: zoomAll,
    quaternion: () => (view ? [view.body.quaternion.w, view.body.quaternion.x, view.body.quaternion.y, view.body.quaternion.z] : quaternionAt(orientation, now)),
    plots,
  };
})();
