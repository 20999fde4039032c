// Where things stand on the page as it opens; left as JSON on the root element.
const place = (selector) => { const { left, right, top, bottom } = document.querySelector(selector).getBoundingClientRect(); return { left, right, top, bottom }; };
const found = { width: innerWidth, height: innerHeight, wide: document.documentElement.scrollWidth, t: clock.t };
for (const [name, selector] of Object.entries({ robot: "canvas.robot", plan: "#plan", player: ".player", views: ".views", scale: "#scale", charts: "#charts", play: "#play", clock: "#clock", speed: "#speed" }))
  found[name] = place(selector);
// Whatever can be reached by the keyboard, in order.
found.tabbable = [...document.querySelectorAll("a[href], button, input, select, summary, [tabindex='0']")].filter((e) => e.tabIndex >= 0 && e.offsetParent !== null).length;
found.unnamed = [...document.querySelectorAll("button, input, select, canvas[tabindex]")].filter((e) => !(e.textContent.trim() || e.getAttribute("aria-label") || e.title)).length;
// Words of tables that stand on two lines, but for those that no column has room for.
const torn = (cell) => {
  const walker = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT), words = [];
  while (walker.nextNode()) for (const { 0: word, index } of walker.currentNode.data.matchAll(/[^\s]+/g)) {
    const range = document.createRange();
    range.setStart(walker.currentNode, index); range.setEnd(walker.currentNode, index + word.length);
    if (word.length < 13 && range.getClientRects().length > 1) words.push(word);
  }
  return words;
};
found.torn = [...document.querySelectorAll("th, td")].flatMap(torn);
found.hidden = [...document.querySelectorAll(".reason")].filter((e) => innerWidth < 900 && e.scrollHeight > e.clientHeight + 1).length;
document.documentElement.dataset.layout = JSON.stringify(found);
