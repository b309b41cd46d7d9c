-- expect: 6: a group of values is taken for one: p.NAME, s.q.NAME or s.points.NAME.x is one
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = #s.points }
  end }
