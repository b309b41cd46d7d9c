-- expect: 6: link a: products of inertia 0.9 0 0; too large for the moments of any body
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "phi" }, mass = 1, inertia = { xx = 1, yy = 1, zz = 1, xy = 0.9 } },
  },
}
