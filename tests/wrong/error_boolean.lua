-- expect: 4: error(...) with a value of type boolean, a text is needed
local rd = require "refdyn"
local function check(x)
  error(x)
end
check(false)
