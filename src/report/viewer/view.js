// A view on the page: camera, pointer and keys, probe.

const BANDS = 12;
const EYE = [1.3, -1.5, 0.9];
// Colours of parts without values.
const TINTS = [[0.6, 0.65, 0.69], [0.52, 0.64, 0.8], [0.78, 0.66, 0.5], [0.55, 0.71, 0.57], [0.72, 0.58, 0.74]];
// Share of the canvas that a fitted view fills, and width beside it for the colour bar [px].
const FILL = 0.92;
const KEY_WIDTH = 104;

// Axes of the picture for a turn about z and an elevation: right, up, to the eye.
function axesOf(turn, rise) {
  const [ct, st, cr, sr] = [Math.cos(turn), Math.sin(turn), Math.cos(rise), Math.sin(rise)];
  return [[-st, ct, 0], [-sr * ct, -sr * st, cr], [cr * ct, cr * st, sr]];
}

// Box around boxes.
function around(boxes) {
  const all = (k, of) => [0, 1, 2].map((c) => of(...boxes.map((box) => box[k][c])));
  return [all(0, Math.min), all(1, Math.max)];
}

let device = null;
const views = [];

class View {
  static async make(figure) {
    const spec = JSON.parse(figure.querySelector("script.scene").textContent);
    if (!device) {
      device = new Device();
      watchContext();
    }
    const view = new View();
    const parts = await Promise.all(spec.parts.map(Part.load));
    // From the last on, so that tools have one colour in views with and without the sheet.
    [...parts].reverse().forEach((part, k) => (part.tint = TINTS[k % TINTS.length]));
    Object.assign(view, {
      figure, parts, fields: spec.fields.filter((field) => field.limits), accuracy: spec.accuracy,
      steps: spec.steps.length ? spec.steps : [""], step: Math.max(0, spec.steps.length - 1),
      whole: true, edges: false, bands: 0, section: null, pinned: false, hit: null, limits: [0, 1],
      turn: Math.atan2(EYE[1], EYE[0]), rise: Math.asin(EYE[2] / Math.hypot(...EYE)),
      centre: [0, 0, 0], scale: 1, waiting: false,
    });
    view.field = view.fields[0]?.name ?? "";
    view.build(spec.title);
    views.push(view);
    return view;
  }

  build(title) {
    this.canvas = element("canvas", { tabIndex: 0, role: "application", "aria-label": `${title}: 3-D view. ${HELP}` });
    this.context = this.canvas.getContext("2d");
    this.key = element("div", { className: "key" });
    this.probe = element("output", { className: "probe" });
    const row = (children, name = "") => element("div", { className: `controls ${name}` }, children);
    const controls = [row(fieldControls(this)), row([...sectionControls(this), ...switches(this)]), row(partControls(this), "parts")];
    if (this.steps.length > 1) controls.push(row([stepControls(this)]));
    const off = this.accuracy > 0 ? ` Places on this page are within ${this.accuracy.toExponential(0)} mm of the results.` : "";
    const help = element("details", {}, [element("summary", { textContent: "Mouse, touch and keys" }), HELP + off]);
    this.figure.append(...controls, element("div", { className: "stage" }, [this.canvas, this.key]), this.probe, help);
    this.figure.classList.add("live");
    this.resetLimits();
    this.fit();
    this.listen();
  }

  set(name, value) {
    this[name] = value;
    drawKey(this.key, this);
    this.redraw();
  }

  setStep(step) {
    this.step = step;
    this.redraw();
    this.showHit();
  }

  setField(name) {
    this.field = name;
    if (name) this.resetLimits();
    else this.set("field", "");
    this.showHit();
  }

  setLimit(k, value) {
    if (Number.isFinite(value)) this.limits[k] = value;
    this.showLimits();
    this.set("limits", this.limits);
  }

  resetLimits() {
    const field = this.fields.find((one) => one.name === this.field);
    if (field) this.limits = [...field.limits];
    this.showLimits?.();
    this.set("limits", this.limits);
  }

  // Limits over what is shown at this step.
  fitLimits() {
    let [low, high] = [Infinity, -Infinity];
    for (const part of this.shownParts()) {
      for (const value of part.field(this.field, this.step)?.values ?? []) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    if (low <= high) this.limits = [low, high];
    this.showLimits();
    this.set("limits", this.limits);
  }

  shownParts() {
    return this.parts.filter((part) => part.visibility !== "hidden");
  }

  // The part of the section at a fraction of the box around the view; cuts away the side of the eye.
  setSection(axis, fraction) {
    const [low, high] = this.box();
    if (axis === null) this.section = null;
    else {
      const side = this.section?.axis === axis ? this.section.side : Math.sign(axesOf(this.turn, this.rise)[2][axis]) || 1;
      this.section = { axis, side, at: low[axis] + fraction * (high[axis] - low[axis]) };
    }
    this.redraw();
  }

  turnSection() {
    if (this.section) this.section.side *= -1;
    this.redraw();
  }

  // Box around all parts at all steps, with their images.
  box() {
    if (this.bounds) return this.bounds;
    const [low, high] = around(this.parts.map((part) => part.box()));
    this.bounds = low[0] <= high[0] ? [low, high] : [[0, 0, 0], [1, 1, 1]];
    return this.bounds;
  }

  // Fits the parts shown at this step into the canvas.
  fit() {
    const axes = axesOf(this.turn, this.rise);
    const [low, high] = around(this.shownParts().map((part) => part.extent(this.step, this.whole, axes)));
    if (low[0] > high[0]) return;
    const middle = low.map((x, c) => 0.5 * (x + high[c]));
    this.centre = [0, 1, 2].map((c) => axes.reduce((sum, axis, k) => sum + axis[c] * middle[k], 0));
    const [width, height] = [this.canvas.clientWidth || 800, this.canvas.clientHeight || 500];
    const beside = this.field && width > 4 * KEY_WIDTH ? KEY_WIDTH : 0;
    this.scale = FILL * Math.min((width - beside) / (high[0] - low[0] || 1), height / (high[1] - low[1] || 1));
    this.move(-0.5 * beside, 0);
  }

  look(turn, rise) {
    [this.turn, this.rise] = [turn, rise];
    this.fit();
  }

  rotate(dx, dy) {
    this.turn -= dx;
    this.rise = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.rise + dy));
    this.redraw();
  }

  // Moves the picture by pixels.
  move(dx, dy) {
    const [right, up] = axesOf(this.turn, this.rise);
    this.centre = this.centre.map((x, c) => x - (right[c] * dx - up[c] * dy) / this.scale);
    this.redraw();
  }

  // Zooms about a place on the canvas, from its middle [px].
  zoom(factor, x = 0, y = 0) {
    this.move(-x, -y);
    this.scale *= factor;
    this.move(x, y);
  }

  redraw() {
    if (this.waiting || !this.context) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    if (device.gl.isContextLost()) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => Math.round(n * ratio));
    if (!width || !height) return;
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    if (this.buffers?.[0]?.generation !== device.generation) this.buffers = this.parts.map((part) => new PartBuffers(device, part));
    const [low, high] = this.box();
    const middle = low.map((x, c) => 0.5 * (x + high[c]));
    const depth = Math.hypot(...high.map((x, c) => x - low[c])) + Math.hypot(...middle.map((x, c) => x - this.centre[c]));
    const field = this.fields.find((one) => one.name === this.field);
    const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
    drawScene(device, this.buffers, {
      camera: { axes: axesOf(this.turn, this.rise), centre: this.centre, scale: this.scale, depth },
      width, height, ratio, step: this.step, field: this.field, limits: this.limits, bands: this.bands, edges: this.edges,
      whole: this.whole, section: this.section, colors: field?.colors ?? [[0, 0, 0], [0, 0, 0]], ink: dark ? [1, 1, 1] : [0.75, 0, 0.35],
    });
    device.copyTo(this.context, width, height);
    this.drawProbe(ratio);
    this.drawAxes(ratio, height);
  }

  // A ring at the place of the probe.
  drawProbe(ratio) {
    if (!this.hit) return;
    const [right, up] = axesOf(this.turn, this.rise);
    const from = this.hit.place.map((x, c) => x - this.centre[c]);
    const x = (0.5 * this.canvas.width) + ratio * this.scale * dot(right, from);
    const y = (0.5 * this.canvas.height) - ratio * this.scale * dot(up, from);
    for (const [color, size] of [["#fff", 4], ["#000", 2]]) {
      this.context.beginPath();
      this.context.arc(x, y, 6 * ratio, 0, 2 * Math.PI);
      this.context.strokeStyle = color;
      this.context.lineWidth = 0.5 * size * ratio;
      this.context.stroke();
    }
  }

  // Directions of x, y and z in the lower left corner.
  drawAxes(ratio, height) {
    const [right, up] = axesOf(this.turn, this.rise);
    const { context } = this;
    const [x, y, length] = [40 * ratio, height - 40 * ratio, 26 * ratio];
    const ink = getComputedStyle(this.figure).color;
    context.font = `${12 * ratio}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    [context.strokeStyle, context.fillStyle, context.lineWidth] = [ink, ink, 1.5 * ratio];
    ["x", "y", "z"].forEach((name, c) => {
      const [dx, dy] = [right[c], -up[c]];
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + length * dx, y + length * dy);
      context.stroke();
      context.fillText(name, x + 1.35 * length * dx, y + 1.35 * length * dy);
    });
  }

  // Place on the canvas from its middle [px].
  fromMiddle(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left - 0.5 * box.width, event.clientY - box.top - 0.5 * box.height];
  }

  probeAt(x, y) {
    const [right, up, eye] = axesOf(this.turn, this.rise);
    const from = this.centre.map((p, c) => p + (right[c] * x - up[c] * y) / this.scale);
    const keeps = (p) => !this.section || this.section.side * (p[this.section.axis] - this.section.at) <= 0;
    this.hit = null;
    for (const wanted of ["shown", "transparent"]) {
      if (this.hit) break;
      for (const part of this.parts.filter((one) => one.visibility === wanted)) {
        const hit = part.pick(this.step, this.whole, from, eye, keeps);
        if (hit && (!this.hit || hit.depth > this.hit.depth)) this.hit = hit;
      }
    }
    this.showHit();
    this.redraw();
  }

  // The probe in words. At another step it stays on the same place of the same cell.
  showHit() {
    if (!this.hit) {
      this.probe.textContent = "";
      return;
    }
    const { part, image } = this.hit;
    const mirrored = image.flip.some((f) => f < 0);
    const found = part.describe(this.hit, this.field, this.step);
    this.hit.place = found.place;
    const words = [`${part.name}${mirrored ? " (mirrored)" : ""}`];
    if (found.value !== null) words.push(`${this.field} ${digits(found.value)}`);
    words.push(`${part.cellName} ${found.cell}`);
    words.push(`point ${found.point}${found.pointValue === null ? "" : `: ${digits(found.pointValue)}`}`);
    const places = this.hit.place.map((x) => x.toFixed(decimals(this.accuracy)));
    words.push(`(${places.join(", ")}) mm`);
    this.probe.textContent = words.join("; ");
  }

  listen() {
    const { canvas } = this;
    const fingers = new Map();
    let moved = 0;
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
      if (fingers.size === 1) moved = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = fingers.get(event.pointerId);
      if (!last) {
        if (!this.pinned) this.probeAt(...this.fromMiddle(event));
        return;
      }
      const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
      moved += Math.abs(dx) + Math.abs(dy);
      if (fingers.size === 2) this.pinch(fingers, event, [dx, dy]);
      else if (event.shiftKey || event.buttons > 1) this.move(dx, dy);
      else this.rotate(dx * 0.008, dy * 0.008);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    const end = (event) => {
      const click = fingers.delete(event.pointerId) && fingers.size === 0 && moved < 4 && event.type === "pointerup";
      if (!click) return;
      this.pinned = false;
      this.probeAt(...this.fromMiddle(event));
      this.pinned = this.hit !== null;
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), ...this.fromMiddle(event));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.redraw()).observe(canvas);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  // Two fingers: the picture moves with their middle and grows with their distance.
  pinch(fingers, event, [dx, dy]) {
    const [id] = [...fingers.keys()].filter((key) => key !== event.pointerId);
    const [ox, oy] = fingers.get(id);
    const [x, y] = fingers.get(event.pointerId);
    const before = Math.hypot(x - ox, y - oy);
    const after = Math.hypot(event.clientX - ox, event.clientY - oy);
    this.move(0.5 * dx, 0.5 * dy);
    if (before > 0) this.zoom(after / before, ...this.fromMiddle({ clientX: 0.5 * (event.clientX + ox), clientY: 0.5 * (event.clientY + oy) }));
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = arrows[event.key];
    const keys = {
      "+": () => this.zoom(1.2), "=": () => this.zoom(1.2), "-": () => this.zoom(1 / 1.2),
      f: () => this.fit(), x: () => this.look(0, 0), y: () => this.look(-Math.PI / 2, 0), z: () => this.look(-Math.PI / 2, Math.PI / 2),
      e: () => this.flipEdges(), w: () => this.flipWhole?.(), p: () => this.probeAt(0, 0),
      "[": () => this.showStep?.(this.step - 1), "]": () => this.showStep?.(this.step + 1),
    };
    const act = arrow
      ? () => (event.shiftKey ? this.move(20 * arrow[0], 20 * arrow[1]) : this.rotate(0.09 * arrow[0], 0.09 * arrow[1]))
      : keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  }
}

// A view that cannot be made stays a picture.
async function start(figure) {
  try {
    await View.make(figure);
  } catch (error) {
    figure.classList.remove("live");
    console.warn(`3-D view: ${error.message}`);
  }
}

// Without a context the pictures come back until there is one again.
function watchContext() {
  device.canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    views.forEach((view) => view.figure.classList.remove("live"));
  });
  device.canvas.addEventListener("webglcontextrestored", () => {
    device.setUp();
    for (const view of views) {
      view.figure.classList.add("live");
      view.redraw();
    }
  });
}

const seen = new IntersectionObserver((entries) => {
  for (const { target } of entries.filter((entry) => entry.isIntersecting)) {
    seen.unobserve(target);
    start(target);
  }
}, { rootMargin: "400px" });
document.querySelectorAll("figure.view").forEach((figure) => seen.observe(figure));
