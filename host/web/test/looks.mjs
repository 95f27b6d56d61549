// Looks of a page, measured: how much of the stage bodies cover, and whether texts and numbers can be read.

/** Share of the stage that strong colours cover in a screenshot of a page that a tab shows at the same size. */
export const share = (tab, png) =>
  tab.evaluate(`(async () => {
    const bytes = Uint8Array.from(atob("${png.toString("base64")}"), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes]));
    const { left, top, width, height } = document.querySelector("#stage").getBoundingClientRect();
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(left, top, width, height);
    let strong = 0;
    for (let i = 0; i < data.length; i += 4) {
      const [r, g, b] = data.subarray(i, i + 3);
      strong += Math.max(r, g, b) - Math.min(r, g, b) > 60;
    }
    return (4 * strong) / data.length;
  })()`);

/** Runs in a document: what overflows it, numbers broken over lines, texts below the contrast of WCAG 2, AA. */
function look() {
  const faults = [];
  const root = document.documentElement;
  if (root.scrollWidth > root.clientWidth) {
    faults.push(`${root.scrollWidth} px wide in ${root.clientWidth}`);
  }
  const pen = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  /** A colour over another. */
  const over = (colour, below, opacity = 1) => {
    pen.globalAlpha = 1;
    pen.fillStyle = `rgb(${below.join(" ")})`;
    pen.fillRect(0, 0, 1, 1);
    pen.globalAlpha = opacity;
    pen.fillStyle = colour;
    pen.fillRect(0, 0, 1, 1);
    return [...pen.getImageData(0, 0, 1, 1).data].slice(0, 3);
  };
  const luminance = (colour) => {
    const [r, g, b] = colour.map((c) => (c <= 10 ? c / 3294 : ((c / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (element) => {
    const below = element.parentElement ? behind(element.parentElement) : [255, 255, 255];
    return over(getComputedStyle(element).backgroundColor, below);
  };
  /** In a plot: the rectangles below the middle of a text, from the first to the last. */
  const behindInPlot = (text) => {
    const box = text.getBoundingClientRect();
    const [x, y] = [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
    let below = behind(text.closest("svg").parentElement);
    for (const rect of text.closest("svg").querySelectorAll("rect")) {
      const { left, right, top, bottom } = rect.getBoundingClientRect();
      const isBelow = rect.compareDocumentPosition(text) & Node.DOCUMENT_POSITION_FOLLOWING;
      if (isBelow && left <= x && x <= right && top <= y && y <= bottom) {
        const { fill, fillOpacity, opacity } = getComputedStyle(rect);
        below = over(fill, below, fillOpacity * opacity);
      }
    }
    return below;
  };
  const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (words.nextNode()) {
    const element = words.currentNode.parentElement;
    const name = words.currentNode.data.trim();
    const isShown = element.checkVisibility() && element.getBoundingClientRect().width > 0;
    if (!name || !isShown || element.closest("style, script, title")) {
      continue;
    }
    const range = document.createRange();
    range.selectNodeContents(words.currentNode);
    if (element.matches(".r") && range.getClientRects().length > 1) {
      faults.push(`broken over lines: ${name}`);
    }
    const style = getComputedStyle(element);
    const inPlot = element.closest("svg");
    const below = inPlot ? behindInPlot(element) : behind(element);
    const ink = inPlot ? over(style.fill, below, style.fillOpacity * style.opacity) : over(style.color, below);
    const [dark, light] = [luminance(ink), luminance(below)].sort((a, b) => a - b);
    const size = parseFloat(style.fontSize);
    const isLarge = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
    const contrast = (light + 0.05) / (dark + 0.05);
    if (contrast < (isLarge ? 3 : 4.5)) {
      faults.push(`contrast ${contrast.toFixed(2)}: ${name}`);
    }
  }
  return [...new Set(faults)];
}

/** What makes a tab's document hard to read, a line each. */
export const unreadable = (tab) => tab.evaluate(`(${look})()`);
