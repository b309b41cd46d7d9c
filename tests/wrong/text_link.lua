-- expect: 3: text "a\u{202A}": contains U+202A, which turns the direction of reading; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a\u{202A}", joint = "x", mass = 1 } } }
