/*
 * Unpacks the program of the page, which is three.js and the scripts, and runs it as one script. The policy of
 * the page names this script and the program by their hashes, so that it runs no other.
 */
"use strict";

/* The bytes of a text: base64 of a zlib stream. */
async function unpack(text) {
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}

async function runProgram() {
    const script = document.createElement("script"), element = document.getElementById("program");
    script.textContent = new TextDecoder().decode(await unpack(JSON.parse(element.textContent)));
    element.remove();
    document.body.append(script);
}

if (typeof DecompressionStream === "undefined")
    document.getElementById("too-old").hidden = false;
else
    runProgram();
