-- expect: 3: model Con: a device name of Windows; choose another name
local rd = require "refdyn"
return rd.model {
  name = "Con", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
