/** The element `<impasto-viewer src="…/painting.zarr">`. */
export class ImpastoViewer extends HTMLElement {}

customElements.define("impasto-viewer", ImpastoViewer);
