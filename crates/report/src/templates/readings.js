// Values read off a curve: with the pointer, or with the arrow keys once a figure has the focus.
(() => {
  "use strict";
  const digits = (value) => value.toPrecision(3).replace("-", "−");
  const number = (value) => (value === null || value === undefined ? "–" : digits(value));

  for (const source of document.querySelectorAll("script.readings")) {
    const svg = source.previousElementSibling;
    const data = JSON.parse(source.textContent);
    const [left, right, top, bottom] = data.frame;
    const [first, last] = data.x;
    const place = (time) => left + ((time - first) / (last - first)) * (right - left);

    const cursor = document.createElementNS(svg.namespaceURI, "line");
    cursor.setAttribute("class", "cursor");
    cursor.setAttribute("y1", top);
    cursor.setAttribute("y2", bottom);
    const box = document.createElement("output");
    box.className = "reading";
    box.hidden = true;
    source.after(box);
    svg.setAttribute("tabindex", "0");
    svg.parentElement.classList.add("readable");
    // The browser's own tip would cover the values; the name stays in aria-label.
    svg.querySelector("title")?.remove();

    let index = -1;
    const hide = () => {
      index = -1;
      box.hidden = true;
      cursor.remove();
    };
    const show = (wanted) => {
      const next = Math.max(0, Math.min(data.time_s.length - 1, wanted));
      if (next === index) return;
      index = next;
      const x = place(data.time_s[index]);
      cursor.setAttribute("x1", x);
      cursor.setAttribute("x2", x);
      svg.append(cursor);
      const rows = data.series.map((one) => {
        const row = document.createElement("span");
        const colour = document.createElementNS(svg.namespaceURI, "svg");
        colour.setAttribute("viewBox", "0 0 10 10");
        const dot = document.createElementNS(svg.namespaceURI, "rect");
        for (const [name, value] of [["width", 10], ["height", 10], ["fill", one.ink]]) dot.setAttribute(name, value);
        colour.append(dot);
        const band = one.lower.length ? ` (${number(one.lower[index])} to ${number(one.upper[index])})` : "";
        row.append(colour, ` ${one.name} ${number(one.value[index])}${band}`);
        return row;
      });
      const head = document.createElement("b");
      head.textContent = `${data.time_s[index].toFixed(2)} s${data.unit ? `, values in ${data.unit}` : ""}`;
      box.replaceChildren(head, ...rows);
      box.hidden = false;
    };
    const nearest = (event) => {
      const area = svg.getBoundingClientRect();
      const x = ((event.clientX - area.left) / area.width) * svg.viewBox.baseVal.width;
      const time = first + ((x - left) / (right - left)) * (last - first);
      const after = data.time_s.findIndex((one) => one >= time);
      if (after < 1) return after < 0 ? data.time_s.length - 1 : 0;
      return time - data.time_s[after - 1] < data.time_s[after] - time ? after - 1 : after;
    };
    svg.addEventListener("pointermove", (event) => show(nearest(event)));
    svg.addEventListener("pointerdown", (event) => show(nearest(event)));
    svg.addEventListener("pointerleave", hide);
    svg.addEventListener("focus", () => { if (index < 0 && svg.matches(":focus-visible")) show(0); });
    svg.addEventListener("blur", hide);
    svg.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity }[event.key];
      if (event.key === "Escape") return hide();
      if (step === undefined) return;
      event.preventDefault();
      show(index + step);
    });
  }
})();
