-- expect: 5: parameter m: the name is already taken in line 4; choose another name
local rd = require "refdyn"
local p = rd.parameters {
  { "m", 1, "kg" },
  { "m", 2, "kg" },
}
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
