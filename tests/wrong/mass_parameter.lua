-- expect: 8: links[1].mass: value -1; must be positive
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" }, { "k", 10, "N/m" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" },
      mass = p.m - 2 },
  },
}
