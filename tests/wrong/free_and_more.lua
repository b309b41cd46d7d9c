-- expect: 6: links[1].joint[1]: "free" is no joint, x y z phi theta psi are
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "free", "x" }, mass = 1 },
  },
}
