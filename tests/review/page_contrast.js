// Text that is hard to read on what lies below it: contrast under 4.5 (3 for large letters), as WCAG 2.2 counts it.
() => {
  const read = (colour) => {
    const found = colour.match(/^rgba?\(([^)]+)\)/) ?? colour.match(/^color\(srgb ([^)]+)\)/);
    if (found === null) return null;
    const values = found[1].split(/[ ,/]+/).map(Number);
    const scale = colour.startsWith("color") ? 255 : 1;
    return [values[0] * scale, values[1] * scale, values[2] * scale, values[3] ?? 1];
  };
  const over = (above, below) => [0, 1, 2].map((n) => above[n] * above[3] + below[n] * (1 - above[3])).concat(1);
  const light = (colour) => {
    const [red, green, blue] = colour.slice(0, 3).map((value) => {
      const part = value / 255;
      return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
  };
  const wrong = new Set();
  const modal = [...document.querySelectorAll("dialog[open]")].filter((one) => one.matches(":modal")).at(-1);
  for (const one of (modal ?? document.body).querySelectorAll("*")) {
    if (![...one.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim() !== "")) continue;
    const box = one.getBoundingClientRect();
    if (box.width < 2 || box.height < 2) continue;
    if (one.closest(".visually-hidden, .timeline-hidden, .skip, option, canvas, :disabled") !== null) continue;
    const style = getComputedStyle(one);
    if (style.visibility === "hidden") continue;
    const layers = [];
    let opacity = 1;
    for (let each = one; each !== null; each = each.parentElement) {
      const below = getComputedStyle(each);
      opacity *= Number(below.opacity);
      const colour = read(below.backgroundColor);
      if (colour !== null && colour[3] > 0) layers.push(colour);
      if (colour !== null && colour[3] === 1) break;
    }
    const ground = layers.reverse().reduce((below, above) => over(above, below), [255, 255, 255, 1]);
    const ink = read(style.color);
    if (ink === null) continue;
    const [first, second] = [light(over([...ink.slice(0, 3), ink[3] * opacity], ground)), light(ground)];
    const contrast = (Math.max(first, second) + 0.05) / (Math.min(first, second) + 0.05);
    const size = parseFloat(style.fontSize);
    const isLarge = size >= 24 || (size >= 18.6 && Number(style.fontWeight) >= 700);
    if (contrast < (isLarge ? 3 : 4.5)) {
      wrong.add(`contrast ${contrast.toFixed(2)}: ${one.localName}.${[...one.classList].join(".")} `
        + `"${one.textContent.trim().slice(0, 40)}"`);
    }
  }
  return [...wrong];
}
