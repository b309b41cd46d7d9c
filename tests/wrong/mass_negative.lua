-- expect: 7: links[1].mass: value -1; must be positive
-- expect: 8: links[2].mass: value 0; must be positive
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = -1 },
    { "b", on = "a", joint = { "x" }, mass = 0 },
  },
}
