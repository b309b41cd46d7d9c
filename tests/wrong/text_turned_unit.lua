-- expect: 3: text "\u{202E}gk": contains U+202E, which turns the direction of reading; remove it
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "\u{202E}gk" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
