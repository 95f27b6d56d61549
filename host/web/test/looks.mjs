// Looks of a page, measured: how much of the stage bodies cover, and the contrast of texts.

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

/** An expression: texts with less contrast than WCAG's level AA asks for. */
export const lowContrasts = `(() => {
  const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  const parts = (colour) => {
    context.clearRect(0, 0, 1, 1);
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    return [...context.getImageData(0, 0, 1, 1).data].map((part) => part / 255);
  };
  const over = ([r, g, b, a], below) => [r, g, b].map((part, i) => a * part + (1 - a) * below[i]);
  const ground = (element) =>
    element ? over(parts(getComputedStyle(element).backgroundColor), ground(element.parentElement)) : [1, 1, 1];
  const light = (rgb) => rgb
    .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
    .reduce((sum, part, i) => sum + part * [0.2126, 0.7152, 0.0722][i], 0);
  const contrast = (element) => {
    const { color, fill } = getComputedStyle(element);
    const below = ground(element);
    const [a, b] = [over(parts(element instanceof SVGElement ? fill : color), below), below].map(light);
    return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const low = [];
  while (walker.nextNode()) {
    const { data, parentElement: element } = walker.currentNode;
    const isShown = data.trim() && element.checkVisibility() && element.getBoundingClientRect().width > 0;
    if (isShown && contrast(element) < 4.5) {
      low.push(data.trim() + " " + contrast(element).toFixed(2));
    }
  }
  return low;
})()`;
