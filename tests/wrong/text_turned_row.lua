-- expect: 4: text "row\u{2067}": contains U+2067, which turns the direction of reading; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  constraints = function(s) return { rd.position { s.q.a_x, name = "row\u{2067}" } } end }
