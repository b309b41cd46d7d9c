-- expect: 3: U+202E (a character that turns the direction of reading) outside a text; write nothing in its place
local rd = require "refdyn"
local x = ‮ 2
