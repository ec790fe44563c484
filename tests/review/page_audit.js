// Walks what is shown and returns what is wrong with it, one line each: controls that a screen reader cannot name,
// things that reach beyond the window, text that is cut off and said nowhere in full.
() => {
  const wrong = [];
  const shown = (one) => {
    if (one.closest("[hidden], [inert]") !== null || one.matches(".skip:not(:focus)")) return false;
    const style = getComputedStyle(one);
    const box = one.getBoundingClientRect();
    return style.visibility !== "hidden" && style.display !== "none" && box.width > 1 && box.height > 1;
  };
  const modal = [...document.querySelectorAll("dialog[open]")].filter((one) => one.matches(":modal")).at(-1);
  const root = modal ?? document.body;
  const describe = (one) => {
    const names = [...one.classList].map((name) => `.${name}`).join("");
    return `${one.localName}${names} "${(one.textContent ?? "").trim().slice(0, 40)}"`;
  };
  const spoken = (one) => {
    if (one.nodeType === Node.TEXT_NODE) return one.textContent ?? "";
    if (!(one instanceof Element) || one.getAttribute("aria-hidden") === "true") return "";
    if (one.localName === "svg") return one.querySelector("title")?.textContent ?? one.getAttribute("aria-label") ?? "";
    return one.getAttribute("aria-label") ?? [...one.childNodes].map(spoken).join("");
  };
  const nameOf = (one) => {
    const by = (one.getAttribute("aria-labelledby") ?? "").split(/\s+/).filter(Boolean);
    if (by.length > 0) return by.map((id) => spoken(document.getElementById(id) ?? document.createTextNode(""))).join(" ");
    if (one.hasAttribute("aria-label")) return one.getAttribute("aria-label");
    if ("labels" in one && one.labels?.length > 0) {
      // What the label says besides the values of the control itself.
      return [...one.labels].map((label) => [...label.childNodes].filter((node) => node !== one).map(spoken).join(""))
        .join(" ");
    }
    const isField = ["input", "select", "textarea"].includes(one.localName);
    return (isField ? "" : spoken(one)) || (one.getAttribute("title") ?? "");
  };

  const controls = "button, input, select, textarea, a[href], summary, dialog, canvas, video, [tabindex='0'], "
    + "[role=button], [role=radio], [role=tab], [role=option], [role=menuitem], [role=slider], [role=separator], "
    + "[role=menu], [role=dialog], [role=group], [role=radiogroup], [role=tablist], nav, aside";
  for (const one of [root, ...root.querySelectorAll(controls)].filter((one) => one.matches(controls))) {
    if (!shown(one) || one.closest("[aria-hidden=true]") !== null) continue;
    const isGroup = one.matches("[role=group], [role=radiogroup], nav, aside");
    if (isGroup && one.matches(".button-group")) continue; // buttons that stand together and name themselves
    const name = (nameOf(one) ?? "").trim();
    if (!/[\p{L}\p{N}]/u.test(name)) wrong.push(`no name: ${describe(one)} says "${name}"`);
  }

  const { innerWidth: width, innerHeight: height } = window;
  const whole = document.documentElement;
  if (whole.scrollWidth > width || whole.scrollHeight > height) {
    wrong.push(`the page is ${whole.scrollWidth} x ${whole.scrollHeight} in a window of ${width} x ${height}`);
  }
  const scrolls = (one, axis) => {
    for (let each = one.parentElement; each !== null; each = each.parentElement) {
      const style = getComputedStyle(each);
      if (/auto|scroll/.test(axis === "x" ? style.overflowX : style.overflowY)) return true;
      if (each === modal) return false;
    }
    return false;
  };
  const saysAll = (one) => {
    for (let each = one; each !== null && each !== root.parentElement; each = each.parentElement) {
      if (each.hasAttribute("title") || each.hasAttribute("aria-label")) return true;
      if (each.matches("button, li, tr, td, summary, h1, h2, legend, label")) return false;
    }
    return false;
  };
  for (const one of root.querySelectorAll("*")) {
    if (!(one instanceof HTMLElement) || !shown(one)) continue;
    const style = getComputedStyle(one);
    if (/auto|scroll/.test(style.overflowX) && one.scrollWidth > one.clientWidth + 1 && !one.matches("input")) {
      wrong.push(`scrolls sideways: ${describe(one)}`);
    }
    if (style.clipPath !== "none" || one.closest(".visually-hidden, .timeline-hidden") !== null) continue;
    const box = one.getBoundingClientRect();
    const text = [...one.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim() !== "");
    if (!text && !one.matches("button, input, select, textarea, canvas, video")) continue;
    if ((box.right > width + 1 || box.left < -1) && !scrolls(one, "x")) wrong.push(`beyond the side: ${describe(one)}`);
    if ((box.bottom > height + 1 || box.top < -1) && !scrolls(one, "y")) wrong.push(`beyond the end: ${describe(one)}`);
    if (!text || one.matches("option, optgroup")) continue;
    const cut = one.scrollWidth > one.clientWidth + 1 && one.clientWidth > 0 && style.overflowX !== "visible";
    if (cut && style.display !== "inline" && !/auto|scroll/.test(style.overflowX)) {
      if (style.textOverflow !== "ellipsis") wrong.push(`cut off: ${describe(one)}`);
      else if (!saysAll(one)) wrong.push(`cut off and not in any hint: ${describe(one)}`);
    }
    // Text that runs out of its own button or cell into the next one.
    const range = document.createRange();
    range.selectNodeContents(one);
    const words = range.getBoundingClientRect();
    const holder = one.closest("button, td, th, .badge");
    if (holder !== null && style.overflowX === "visible") {
      const place = holder.getBoundingClientRect();
      let kept = false;
      for (let each = one; each !== holder; each = each.parentElement) {
        if (getComputedStyle(each).overflowX !== "visible") kept = true;
      }
      kept ||= getComputedStyle(holder).overflowX !== "visible";
      if (!kept && (words.right > place.right + 1 || words.left < place.left - 1)) {
        wrong.push(`runs out of its ${holder.localName}: ${describe(one)}`);
      }
    }
  }
  return [...new Set(wrong)];
}
