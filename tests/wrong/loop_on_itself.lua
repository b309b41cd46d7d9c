-- expect: 6: constraints[1]: depends on no coordinate; must contain a coordinate or the position of a moving point
local rd = require "refdyn"
return rd.model { name = "wrong", links = {
    { "a", joint = "x, y", mass = 1 } },
  constraints = function()
    return { rd.loop { "a", "a" } }
  end }
