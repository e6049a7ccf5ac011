import "./impasto-viewer";
