// Controls of a view: elements of the page, and what they set.

function element(tag, properties = {}, children = []) {
  const out = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key in out) out[key] = value;
    else out.setAttribute(key, value);
  }
  out.append(...children);
  return out;
}

const labelled = (text, control) => element("label", {}, [text, control]);

function choice(label, options, value, set) {
  const select = element("select", {}, options.map(([key, text]) => element("option", { value: key, textContent: text })));
  select.value = value;
  select.addEventListener("change", () => set(select.value));
  return { select, label: labelled(label, select) };
}

function tick(label, checked, set) {
  const box = element("input", { type: "checkbox", checked });
  box.addEventListener("change", () => set(box.checked));
  return { box, label: element("label", {}, [box, label]) };
}

function button(text, act) {
  const out = element("button", { type: "button", textContent: text });
  out.addEventListener("click", act);
  return out;
}

// Milliseconds between steps when they play.
const PLAY_MS = 500;

function stepControls(view) {
  const last = view.steps.length - 1;
  const slider = element("input", { type: "range", min: 0, max: last, step: 1, value: last, className: "step" });
  const name = element("output", { textContent: view.steps[last] });
  let timer = 0;
  const show = (step) => {
    slider.value = step;
    name.textContent = view.steps[step];
    slider.setAttribute("aria-valuetext", view.steps[step]);
    view.setStep(step);
  };
  slider.addEventListener("input", () => show(Number(slider.value)));
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    play.textContent = "Play";
  };
  const play = button("Play", () => {
    if (timer) return stop();
    play.textContent = "Stop";
    if (view.step === last) show(0);
    timer = setInterval(() => (view.step < last ? show(view.step + 1) : stop()), PLAY_MS);
  });
  view.showStep = (step) => show(Math.max(0, Math.min(last, step)));
  slider.setAttribute("aria-valuetext", view.steps[last]);
  return element("label", { className: "steps" }, ["Step", slider, play, name]);
}

function fieldControls(view) {
  const names = view.fields.map((field) => [field.name, field.name]);
  const field = choice("Field", [...names, ["", "none"]], view.field, (name) => view.setField(name));
  field.select.classList.add("field");
  const limit = (k, text) => {
    const input = element("input", { type: "number", step: "any", className: `limit${k}` });
    input.addEventListener("change", () => view.setLimit(k, input.value === "" ? NaN : Number(input.value)));
    return [input, labelled(text, input)];
  };
  const [[low, lowLabel], [high, highLabel]] = [limit(0, "from"), limit(1, "to")];
  view.showLimits = () => {
    low.value = Number(view.limits[0].toPrecision(5));
    high.value = Number(view.limits[1].toPrecision(5));
  };
  const all = button("All steps", () => view.resetLimits());
  const own = button(view.steps.length > 1 ? "This step" : "Range", () => view.fitLimits());
  all.title = "Limits over all steps and parts";
  own.title = "Limits over the parts shown at this step";
  const bands = tick("Bands", false, (on) => view.set("bands", on ? BANDS : 0));
  return view.fields.length ? [field.label, lowLabel, highLabel, all, own, bands.label] : [];
}

function sectionControls(view) {
  const slider = element("input", { type: "range", min: 0, max: 1000, step: 1, value: 500, hidden: true, className: "cut" });
  const place = element("output", { hidden: true });
  const other = button("Other side", () => view.turnSection());
  other.hidden = true;
  const show = () => {
    place.textContent = view.section ? `${view.section.at.toFixed(2)} mm` : "";
    for (const one of [slider, place, other]) one.hidden = !view.section;
  };
  const axis = choice("Section", [["", "none"], ["0", "x"], ["1", "y"], ["2", "z"]], "", (value) => {
    view.setSection(value === "" ? null : Number(value), Number(slider.value) / 1000);
    show();
  });
  axis.select.classList.add("section");
  slider.addEventListener("input", () => {
    view.setSection(view.section.axis, Number(slider.value) / 1000);
    show();
  });
  slider.setAttribute("aria-label", "Position of the section");
  return [axis.label, slider, place, other];
}

function partControls(view) {
  const options = ["shown", "transparent", "hidden"].map((word) => [word, word]);
  return view.parts.map((part) => {
    const one = choice(part.name, options, part.visibility, (value) => {
      part.visibility = value;
      view.redraw();
    });
    one.select.classList.add("part");
    return one.label;
  });
}

function switches(view) {
  const edges = tick("Mesh edges", false, (on) => view.set("edges", on));
  view.flipEdges = () => edges.box.click();
  const out = [edges.label];
  if (view.parts.some((part) => part.images.length > 1)) {
    const whole = tick("Whole part", view.whole, (on) => view.set("whole", on));
    view.flipWhole = () => whole.box.click();
    out.push(whole.label);
  }
  out.push(button("Fit", () => view.fit()));
  return out;
}

// The colour bar: gradient or bands, and five values.
function drawKey(key, view) {
  const field = view.fields.find((one) => one.name === view.field);
  key.hidden = !field;
  if (!field) return;
  const color = (t) => {
    const at = t * (field.colors.length - 1);
    const k = Math.min(Math.floor(at), field.colors.length - 2);
    const mixed = [0, 1, 2].map((c) => field.colors[k][c] + (at - k) * (field.colors[k + 1][c] - field.colors[k][c]));
    return `rgb(${mixed.map(Math.round).join(",")})`;
  };
  const n = view.bands || 24;
  const stops = Array.from({ length: n }, (_, k) => {
    const shade = color(view.bands ? (k + 0.5) / n : k / (n - 1));
    return view.bands ? `${shade} ${(100 * k) / n}% ${(100 * (k + 1)) / n}%` : shade;
  });
  const bar = element("i");
  bar.style.background = `linear-gradient(to top, ${stops.join(", ")})`;
  const [low, high] = view.limits;
  const values = [0, 0.25, 0.5, 0.75, 1].map((t) => {
    const text = element("span", { textContent: String(Number((low + t * (high - low)).toPrecision(4))) });
    text.style.top = `${100 * (1 - t)}%`;
    return text;
  });
  key.replaceChildren(element("b", { textContent: field.name }), element("div", {}, [bar, ...values]));
}

const HELP =
  "Drag: rotate; right button, shift or two fingers: move; wheel (after a click on the view) or two fingers: zoom; click: keep the probe. " +
  "Keys on the view: arrows rotate, with shift move; + - zoom; F fit; X Y Z look along an axis; E edges; W whole part; " +
  "[ ] step; P probe in the middle.";
