-- expect: 2: require: no file socket.lua beside the model
local socket = require "socket"
