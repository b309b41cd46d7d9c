-- expect: 7: mass: already given in line 6 of this table; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1,
      mass = 2 },
  },
}
