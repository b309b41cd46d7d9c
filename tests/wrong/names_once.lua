-- expect: 5: link base: the name is already taken in line 4; choose another name
-- expect: 6: links[3].on: no link "quarter"; use one of base, load
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "base", joint = "x", mass = 1 },
  { "base", joint = "x", mass = 1 },
  { "load", joint = "x", mass = 1, on = "quarter" } } }
