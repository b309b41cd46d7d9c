-- expect: 3: setmetatable: __add is of type number; must be a function
local rd = require "refdyn"
setmetatable({}, { __add = 1 })
