-- expect: 3: bad argument #1 to 'setmetatable' (table expected, got number)
local rd = require "refdyn"
setmetatable(1, {})
