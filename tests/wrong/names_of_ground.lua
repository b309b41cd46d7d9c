-- expect: 4: link ground: the name of the fixed frame; choose another name
-- expect: 5: point ground: the name of the fixed frame; choose another name
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "ground", joint = "x", mass = 1, spring = { x = 2 } } },
  points = { ground = { on = "ground", at = { 3, 0, 0 } } },
}
