/** Whether pictures are drawn by the processor (no graphics card, a remote desktop): then with less polish. */

let known: boolean | null = null;

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

export function isSoftwareDrawn(): boolean {
  known ??= askBrowser();
  return known;
}

function askBrowser(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (context === null) return true;
  const details = context.getExtension("WEBGL_debug_renderer_info");
  const name: unknown = context.getParameter(details?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER);
  // A browser grants few contexts; this one has done its work.
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return typeof name === "string" && SOFTWARE.test(name);
}
