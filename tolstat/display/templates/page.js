"use strict";
// The reader: share of the joints above a load, at the loads for which the page holds it; nothing is interpolated.
(() => {
  const held = document.getElementById("reader-data");
  if (!held) return;
  const curves = JSON.parse(held.textContent);
  const part = (name) => document.getElementById("reader" + (name && "-" + name));
  const [form, load, number, slider, unit, said] = ["", "load", "x", "slider", "unit", "said"].map(part);
  const figures = [...document.querySelectorAll("figure[data-reads]")].map((figure) => ({
    svg: figure.querySelector("svg"),
    reads: figure.dataset.reads.split(","),
    frame: figure.dataset.frame.split(" ").map(Number),
  }));

  const percent = (share) => Number((100 * share).toPrecision(3)) + " %";
  const nearest = (x, wanted) => {
    let low = 0, high = x.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (x[middle] <= wanted) low = middle; else high = middle;
    }
    return Math.abs(x[low] - wanted) <= Math.abs(x[high] - wanted) ? low : high;
  };

  function mark(name, x) {
    for (const { svg, reads, frame: [left, right, top, bottom, low, high] } of figures) {
      let line = svg.querySelector(".cursor");
      const place = left + (x - low) / (high - low) * (right - left);
      const shown = reads.includes(name) && place >= left && place <= right;
      if (!line && shown) {
        line = document.createElementNS("http://www.w3.org/2000/svg", "line");
        line.setAttribute("class", "cursor");
        line.setAttribute("y1", top);
        line.setAttribute("y2", bottom);
        svg.append(line);
      }
      if (line) line.style.display = shown ? "" : "none";
      if (shown) for (const end of ["x1", "x2"]) line.setAttribute(end, place);
    }
  }

  function show(i) {
    const name = load.value, curve = curves[name], x = curve.x[i];
    slider.max = curve.x.length - 1;
    slider.value = i;
    slider.setAttribute("aria-valuetext", x + " " + curve.unit);
    number.value = x;
    unit.textContent = curve.unit;
    const ends = (low, high) => percent(curve[low][i]) + " to " + percent(curve[high][i]);
    const valid = curve.n - curve.failed - curve.unsettled, lost = curve.failed + curve.unsettled;
    const strong = document.createElement("b");
    strong.textContent = percent(curve.share[i]);
    let text = " of the joints exceed " + (x + " " + curve.unit).trim() + " on " + name + ": " + curve.count[i] + " of " + valid + ".";
    if (curve.lower) text += " 95 % interval " + ends("lower", "upper") + ".";
    if (lost) text += " With " + lost + " failed or unsettled joints below and above: " +
      (curve.outer_lower ? ends("outer_lower", "outer_upper") : ends("bound_lower", "bound_upper")) + ".";
    said.replaceChildren(strong, text);
    mark(name, x);
  }

  load.addEventListener("change", () => show(curves[load.value].start));
  slider.addEventListener("input", () => show(Number(slider.value)));
  number.addEventListener("change", () => show(nearest(curves[load.value].x, Number(number.value))));
  form.addEventListener("submit", (event) => event.preventDefault());
  for (const { svg, reads, frame: [left, right, , , low, high] } of figures) {
    svg.addEventListener("pointermove", (event) => {
      const box = svg.getBoundingClientRect();
      const place = (event.clientX - box.left) / box.width * svg.viewBox.baseVal.width;
      if (place < left || place > right) return;
      if (!reads.includes(load.value)) load.value = reads[0];
      show(nearest(curves[load.value].x, low + (place - left) / (right - left) * (high - low)));
    });
  }
  form.hidden = false;
  show(curves[load.value].start);
})();
