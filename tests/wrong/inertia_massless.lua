-- expect: 6: links[1].inertia: has no effect without mass; add mass
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "phi" }, inertia = { xx = 1, yy = 1, zz = 1 } },
  },
}
