-- expect: 7: p.n: unknown parameter; use one of m, k
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" }, { "k", 10, "N/m" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = p.n },
  },
}
