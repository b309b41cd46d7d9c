-- expect: 4: x is wrong
local rd = require "refdyn"
local function check(x)
  error("x is wrong", 0)
end
check(1)
