// The picture as a file: the map's canvas, the marks and the scale over it, and a line that says what it shows.

/** Return the picture of the stage as a PNG blob. */
async function pictureOf(canvas, overlay, caption) {
  const ratio = canvas.width / Math.max(1, canvas.clientWidth);
  const line = Math.round(26 * ratio);
  const sheet = made("canvas", { width: canvas.width, height: canvas.height + line });
  const pen = sheet.getContext("2d");
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.drawImage(canvas, 0, 0);
  const origin = canvas.getBoundingClientRect();
  pen.scale(ratio, ratio);
  for (const element of overlay.querySelectorAll(".mark, #scale-bar, #scale-text")) {
    const style = getComputedStyle(element);
    if (style.visibility !== "visible" || Number(style.opacity) === 0) continue;
    drawElement(pen, element, style, origin);
  }
  pen.fillStyle = "#22252a";
  pen.font = "13px system-ui, sans-serif";
  pen.textBaseline = "middle";
  pen.fillText(caption, 8, canvas.clientHeight + 13, canvas.clientWidth - 16);
  return new Promise((resolve) => sheet.toBlob(resolve, "image/png"));
}

function drawElement(pen, element, style, origin) {
  const box = element.getBoundingClientRect();
  const [x, y] = [box.left - origin.left, box.top - origin.top];
  pen.globalAlpha = Number(style.opacity);
  pen.beginPath();
  pen.roundRect(x, y, box.width, box.height, Math.min(parseFloat(style.borderTopLeftRadius) || 0, box.height / 2));
  pen.fillStyle = style.backgroundColor;
  pen.fill();
  if (parseFloat(style.borderLeftWidth) > 2) {
    pen.fillStyle = style.borderLeftColor;
    pen.fillRect(x, y, parseFloat(style.borderLeftWidth), box.height);
  }
  pen.font = `${style.fontWeight} ${style.fontSize} system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const at = [x + box.width / 2, y + box.height / 2];
  if (style.textShadow !== "none") {
    pen.strokeStyle = "#fff";
    pen.lineWidth = 3;
    pen.strokeText(element.textContent, ...at);
  }
  pen.fillStyle = style.color;
  pen.fillText(element.textContent, ...at);
  pen.textAlign = "left";
  pen.globalAlpha = 1;
}

/** Let the browser save a blob under a name. */
function saveAs(blob, name) {
  const link = made("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
