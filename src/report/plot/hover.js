"use strict";
// Values of plots on hover: the point nearest to the pointer, from the numbers beside the drawing.
(() => {
  const figures = document.querySelectorAll("figure.plot");
  const number = (value) => {
    const size = Math.abs(value);
    return size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(4) : String(Number(value.toPrecision(6)));
  };
  const scale = (axis) => {
    const of = axis.log ? Math.log : (value) => value;
    const [v0, v1] = axis.values.map(of);
    const [p0, p1] = axis.pixels;
    return (value) => p0 + ((of(value) - v0) / (v1 - v0)) * (p1 - p0);
  };
  const points = (data) => {
    const [x, y] = [scale(data.x), scale(data.y)];
    const out = [];
    for (const series of data.series) {
      series.x.forEach((a, k) => {
        const index = Array.isArray(series.index) ? series.index[k] : k;
        out.push({ px: x(a), py: y(series.y[k]), x: a, y: series.y[k], name: series.name, index: series.index ? index : null });
      });
    }
    return out;
  };
  const attach = (figure) => {
    const values = figure.querySelector("script.values");
    const svg = figure.querySelector("svg");
    if (!values || !svg) return;
    let all = null;
    const mark = document.createElementNS(svg.namespaceURI, "circle");
    mark.setAttribute("class", "mark");
    mark.setAttribute("r", "6");
    const label = document.createElement("div");
    label.className = "hover";
    const hide = () => {
      mark.remove();
      label.remove();
    };
    // Largest distance of the pointer from a point that is shown [px of the drawing].
    const reach = 40;
    svg.addEventListener("pointermove", (event) => {
      all ??= points(JSON.parse(values.textContent));
      const box = svg.getBoundingClientRect();
      const ratio = svg.viewBox.baseVal.width / box.width;
      const [x, y] = [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
      let best = null;
      let least = reach * reach;
      for (const point of all) {
        const distance = (point.px - x) ** 2 + (point.py - y) ** 2;
        if (distance < least) [best, least] = [point, distance];
      }
      if (!best) return hide();
      mark.setAttribute("cx", best.px);
      mark.setAttribute("cy", best.py);
      svg.append(mark);
      const index = best.index === null ? "" : ` ${best.index}`;
      label.textContent = `${best.name}${index}: ${number(best.x)}, ${number(best.y)}`;
      figure.append(label);
      const frame = figure.getBoundingClientRect();
      const left = box.left - frame.left + best.px / ratio;
      const across = Math.min(left + 12, frame.width - label.offsetWidth);
      label.style.left = `${Math.max(0, across)}px`;
      label.style.top = `${Math.max(0, box.top - frame.top + best.py / ratio - 34)}px`;
    });
    svg.addEventListener("pointerleave", hide);
  };
  figures.forEach(attach);
})();
