-- expect: 8: form: "printd"; must be "corrected" or "printed"
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  form = "printd",
}
