// Moves the stick figures: the drawn end poses become the poses at the time of the slider.
(() => {
  "use strict";
  const section = document.currentScript.closest("section");
  const data = JSON.parse(section.querySelector(".frames").textContent);
  const controls = section.querySelector(".controls");
  const [button, slider, time] = ["button", "input", "output"].map((name) => controls.querySelector(name));
  const arms = [...section.querySelectorAll("figure.arm")].map((figure, run) => {
    const { ink, end, frames } = data.runs[run];
    const drawn = (name, attribute) => figure.querySelectorAll(`figure > svg ${name}[${attribute}="${ink}"]`);
    return {
      frames, end,
      links: drawn("polyline", "stroke")[0],
      joints: drawn("circle", "fill"),
      note: figure.querySelector(".end"),
    };
  });
  const duration = Number(slider.max);

  const show = (now) => {
    const frame = Math.round(now / data.step_s);
    for (const { frames, end, links, joints, note } of arms) {
      const points = frames[Math.min(frame, frames.length - 1)];
      const pairs = [];
      for (let at = 0; at < points.length; at += 2) {
        pairs.push(`${points[at]},${points[at + 1]}`);
        joints[at / 2]?.setAttribute("cx", points[at]);
        joints[at / 2]?.setAttribute("cy", points[at + 1]);
      }
      links.setAttribute("points", pairs.join(" "));
      note.textContent = frame >= frames.length - 1 ? end : "";
    }
    slider.value = now;
    time.textContent = `${now.toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", `${now.toFixed(2)} seconds`);
  };

  let before = null;
  const playing = () => before !== null;
  const tick = (stamp) => {
    if (!playing()) return;
    const now = Math.min(duration, Number(slider.value) + Math.max(0, stamp - before) / 1000);
    before = stamp;
    show(now);
    if (now >= duration) pause(); else requestAnimationFrame(tick);
  };
  const pause = () => {
    before = null;
    button.textContent = "Play";
  };
  const play = () => {
    if (Number(slider.value) >= duration) show(0);
    before = performance.now();
    button.textContent = "Pause";
    requestAnimationFrame(tick);
  };

  // The slider snaps to frames, the clock does not.
  slider.step = "any";
  controls.hidden = false;
  button.addEventListener("click", () => (playing() ? pause() : play()));
  slider.addEventListener("input", () => { pause(); show(Number(slider.value)); });
  slider.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    pause();
    show(Math.max(0, Math.min(duration, Number(slider.value) + step * data.step_s)));
  });
  document.addEventListener("visibilitychange", () => { if (document.hidden) pause(); });

  // It starts once, when it is first seen, unless the reader has asked for less motion; out of sight it rests.
  let started = matchMedia("(prefers-reduced-motion: reduce)").matches;
  new IntersectionObserver(([entry]) => {
    if (!entry.isIntersecting) pause();
    else if (!started) { started = true; play(); }
  }, { threshold: 0.4 }).observe(section.querySelector("figure.arm"));
})();
