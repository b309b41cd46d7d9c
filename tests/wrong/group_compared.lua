-- expect: 6: a group of values in place of one; write p.NAME, s.q.NAME or s.points.NAME.x
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = s.q < 1 and 1 or 2 }
  end }
