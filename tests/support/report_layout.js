// Where things stand on the page as it opens; left as JSON on the root element.
const place = (selector) => { const { left, right, top, bottom } = document.querySelector(selector).getBoundingClientRect(); return { left, right, top, bottom }; };
const found = { width: innerWidth, height: innerHeight, wide: document.documentElement.scrollWidth, t: clock.t };
for (const [name, selector] of Object.entries({ robot: "canvas.robot", plan: "#plan", player: ".player", views: ".views", scale: "#scale", charts: "#charts", play: "#play", clock: "#clock", speed: "#speed" }))
  found[name] = place(selector);
// Whatever can be reached by the keyboard, in order.
found.tabbable = [...document.querySelectorAll("a[href], button, input, select, summary, [tabindex='0']")].filter((e) => e.tabIndex >= 0 && e.offsetParent !== null).length;
found.unnamed = [...document.querySelectorAll("button, input, select, canvas[tabindex]")].filter((e) => !(e.textContent.trim() || e.getAttribute("aria-label") || e.title)).length;
document.documentElement.dataset.layout = JSON.stringify(found);
