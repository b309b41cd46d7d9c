-- expect: 3: model refdyn_model: names that begin with refdyn belong to the runtime; choose another name
local rd = require "refdyn"
return rd.model {
  name = "refdyn_model", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
}
